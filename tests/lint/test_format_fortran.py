#!/usr/bin/env python3
"""The formatter keeps what is right, repairs what is not, and is stable where fprettify alone is not.

Run as a program, not by pytest: fprettify takes hold of stdin when it is imported.
"""

import contextlib
import io
import tempfile
import unittest
from pathlib import Path

import fprettify
from format_fortran import INDENT, formatted, main

GOOD = """!> Doc.
module m
   use other, only: one, two, &
      three
   implicit none
   character(len=*), parameter :: names(2) = [character(len=33) :: 'a long name that fills the line, far beyond', &
      'another long name that fprettify would put under the bracket, beyond the limit of the line, if it could']
contains
   subroutine s(a)
      real, intent(in) :: a(:, :)
      !$omp parallel do default(none) &
      !$omp    shared(a)
      do i = 1, 3
         ! a comment
         if (a(1, i)*2 + 1 > 0) call t('it''s & "this" ! not a (comment) (at all)', &
                                       a(1, i), & ! why
                                       -1)
         write (*, *) names(i)(2:3), (a(j, i), j=1, 2), .not. x
      end do
      text = 'a text that &
             &goes on'
   end subroutine s
end module m
"""


class TestFormat(unittest.TestCase):
    def test_our_layout_is_left_alone(self):
        self.assertEqual(GOOD, formatted(GOOD))

    def test_fprettify_alone_would_not(self):
        output = io.StringIO()
        fprettify.reformat_ffile(io.StringIO(GOOD), output, indent_size=INDENT, orig_filename="m.f90")
        self.assertNotEqual(GOOD, output.getvalue())

    def test_repairs(self):
        for right, wrong in (
            ("      do i = 1, 3", "    do i=1,3"),
            ("if (a(1, i)*2 + 1 > 0)", "if(a(1,i) * 2+1>0)"),
            ("      real, intent", "   real, intent"),
            ("      three", "   three"),
            ("end do", "enddo"),
            ("contains\n", "contains  \n"),
        ):
            with self.subTest(wrong):
                self.assertEqual(GOOD, formatted(GOOD.replace(right, wrong)).replace("enddo", "end do"))

    def test_check_and_fix(self):
        with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()) as output:
            path = Path(folder) / "m.f90"
            path.write_text(GOOD.replace("   implicit none", "     implicit none"), encoding="utf-8")
            self.assertEqual(1, main([str(path)]))
            self.assertIn("+   implicit none", output.getvalue())
            self.assertEqual(0, main(["--fix", str(path)]))
            self.assertEqual(GOOD, path.read_text(encoding="utf-8"))
            self.assertEqual(0, main([str(path)]))


if __name__ == "__main__":
    unittest.main()
