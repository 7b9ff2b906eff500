#!/usr/bin/env python3
"""The check of forgotten members finds what is forgotten, and nothing else."""

import unittest
from pathlib import Path

from state import complaints

TYPE = """module m
   type :: t
      !> a comment, with words
      integer :: n = 0, pair(2) = [1, 2]
      real(wp), allocatable, private :: x(:, :)
      type(other_t) :: other
   contains
      procedure :: exchange
   end type t
contains
"""
WHOLE = """   !> To or from a checkpoint.{derived}
   subroutine exchange(self, archive)
      class(t), intent(inout) :: self
      call archive%exchange('n', self%n)
      call archive%exchange_fixed('pair', self%pair)
      call rest(self, archive)
   end subroutine exchange

   subroutine rest(self, archive)
      call archive%exchange('x', self%x)
      {other}
   end subroutine rest
end module m
"""


def found(text: str, later: str = "") -> list[str]:
    return complaints(Path("m.f90"), text, later)


class Checks(unittest.TestCase):
    def test_whole_type_passes(self) -> None:
        self.assertEqual(found(TYPE + WHOLE.format(derived="", other="call self%other%exchange(archive)")), [])

    def test_forgotten_member_is_named(self) -> None:
        self.assertEqual(
            found(TYPE + WHOLE.format(derived="", other="! self%other is not mentioned here")),
            ["m.f90: t%other is neither exchanged nor named as derived"],
        )

    def test_derived_member_passes(self) -> None:
        self.assertEqual(found(TYPE + WHOLE.format(derived=" (Derived: other\n   !> follows.)", other="")), [])

    def test_member_of_another_object_does_not_count(self) -> None:
        text = TYPE + WHOLE.format(derived="", other="call self%other%exchange(archive)")
        self.assertEqual(
            found(text.replace("self%n)", "archive%other%n)")),
            ["m.f90: t%n is neither exchanged nor named as derived"],
        )

    def test_members_of_a_type_without_exchange(self) -> None:
        plain = "   type :: other_t\n      integer :: a = 0\n      type(inner_t) :: inner(3)\n   end type other_t\n"
        inner = "   type :: inner_t\n      real(wp) :: b = 0, c = 0\n   end type inner_t\n"
        text = TYPE.replace("contains\n   end", "contains\n   end").replace("module m\n", "module m\n" + inner + plain)
        for whole in (
            "use(self%other%a, self%other%inner(i)%b, self%other%inner(f(1))%c)",
            "associate (o => self%other, d => self%other%inner(2))\n use(o%a, d%b, d%c)",
            "call rest(self%other%inner)\n   type(inner_t), intent(inout) :: x(:)\n use(self%other%a, x%b, x%c)",
        ):
            self.assertEqual(found(text + WHOLE.format(derived="", other=whole)), [])
            forgets = whole.replace("%c", "%d")
            self.assertEqual(
                found(text + WHOLE.format(derived="", other=forgets)),
                ["m.f90: t%other%inner%c is neither exchanged nor named as derived"],
            )

    def test_submodule_is_looked_into(self) -> None:
        later = "submodule(m) m_state\n" + WHOLE.format(derived="", other="call self%other%exchange(archive)")
        self.assertEqual(found(TYPE, later.replace("subroutine exchange(", "module subroutine exchange(")), [])

    def test_missing_procedure_is_named(self) -> None:
        self.assertEqual(found(TYPE), ["m.f90: t has no procedure exchange here"])


if __name__ == "__main__":
    unittest.main()
