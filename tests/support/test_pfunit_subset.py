#!/usr/bin/env python3
"""The pFUnit subset's own test: good files run, failures are reported with their lines, bad files are refused.

test_pfunit_subset.py --compiler gfortran --modules FOLDER_OF_FUNIT_MOD --library libfunit_subset.a
"""

import argparse
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import pfunit_subset

HERE = Path(__file__).resolve().parent
OPTIONS = argparse.Namespace(compiler="gfortran", modules="", library="")


def translate(folder, name, text):
    """A test file's Fortran; raises PfError where it is refused."""
    source = Path(folder) / f"{name}.pf"
    source.write_text(text, encoding="utf-8")
    return pfunit_subset.Translation(source).run()


def compile_and_run(folder, name, text, *arguments):
    """Translate, compile, run: the compiler's result if it fails, else the program's."""
    folder = Path(folder)
    (folder / f"{name}.F90").write_text(translate(folder, name, text), encoding="utf-8")
    (folder / "driver.f90").write_text(pfunit_subset.driver([name]), encoding="utf-8")
    command = [
        OPTIONS.compiler,
        "-w",
        "-std=f2008",
        "-ffree-line-length-none",
        "-ffpe-trap=invalid",
        "-I",
        OPTIONS.modules,
    ]
    command += [f"{name}.F90", "driver.f90", OPTIONS.library, "-o", name]
    build = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if build.returncode:
        return build
    return subprocess.run([folder / name, *arguments], cwd=folder, capture_output=True, text=True, check=False)


def module(body, name="test_case", head=""):
    """A test file with the declarations `head` and the procedures `body`."""
    return f"module {name}\n   use funit\n   implicit none\n{head}contains\n{body}end module {name}\n"


def test(body, name="test_it"):
    """One test procedure with this body."""
    return f"   @test\n   subroutine {name}()\n{body}   end subroutine {name}\n"


class TestAssertions(unittest.TestCase):
    """Each assertion passes where it must and fails where it must."""

    PASS = (
        "@assertEqual(3, 1 + 2)",
        "@assertEqual(3.0d0, 1.0d0 + 2.0d0, tolerance=1.0d-12)",
        "@assertEqual(3.0d0, 3.0d0 + 1.0d-9, tolerance=1.0e-8, message='single precision tolerance')",
        "@assertEqual(0, [0.0d0, 0.0d0])",
        "@assertEqual([1, 2], [1, 2])",
        "@assertEqual('abc', ' abc ')",
        "@assertEqual('a, (b''!@', 'a, (b''!@')",
        "@assertEqual(.true., 1 < 2)",
        "@assertNotEqual(1, 2)",
        "@assertNotEqual(1.0d0, 1.1d0, tolerance=0.01d0)",
        "@assertLessThan(1.0d0, 2.0d0)",
        "@assertLessThanOrEqual(1, 1)",
        "@assertGreaterThan([2.0d0, 3.0d0], [1.0d0, 2.0d0])",
        "@assertGreaterThanOrEqual(2, 2)",
        "@assertRelativelyEqual(1.0d9, 1.0d9 + 1, 1.0d-8)",
        "@assertTrue(1 < 2, 'a message')",
        "@assertFalse(1 > 2)",
        "@assertAll([.true., .true.])",
        "@assertAny([.true., .false.])",
        "@assertNone([.false., .false.])",
        "@assertNotAll([.true., .false.])",
        "@assertSameShape(shape([1, 2]), [2])",
        "@assertIsFinite(1.0d0)",
    )
    FAIL = (
        "@assertEqual(3, 4)",
        "@assertEqual(3.0d0, 3.1d0, tolerance=1.0d-2)",
        "@assertEqual(0.0d0, transfer(9221120237041090560_8, 0.0d0))",
        "@assertEqual([1, 2], [1, 2, 3])",
        "@assertEqual([1, 2], [1, 3])",
        "@assertEqual(1.0d0, reshape([1.0d0, 1.0d0, 1.0d0, 2.0d0], [2, 2]))",
        "@assertEqual('abc', 'abd')",
        "@assertEqual('abc', 'abc ', whitespace=KEEP_ALL)",
        "@assertEqual(.true., .false.)",
        "@assertNotEqual(1.0d0, 1.001d0, tolerance=0.01d0)",
        "@assertLessThan(2, 2)",
        "@assertLessThanOrEqual(3.0d0, 2.0d0)",
        "@assertGreaterThan(1, [0, 1])",
        "@assertGreaterThanOrEqual(1.0d0, 2.0d0)",
        "@assertRelativelyEqual(1.0d9, 1.1d9, 1.0d-8)",
        "@assertRelativelyEqual(0.0d0, 0.0d0, 1.0d-8)",
        "@assertTrue(.false.)",
        "@assertFalse([.false., .true.])",
        "@assertAll([.true., .false.])",
        "@assertAny([.false., .false.])",
        "@assertNone([.true., .false.])",
        "@assertNotAll([.true., .true.])",
        "@assertSameShape([1, 2], [2, 1])",
        "@assertIsNaN(1.0d0)",
        "@assertIsFinite(transfer(9221120237041090560_8, 0.0d0))",
        "@assertFail('on purpose')",
        "@assertExceptionRaised('nothing was thrown')",
    )

    def test_passing(self):
        with tempfile.TemporaryDirectory() as folder:
            result = compile_and_run(
                folder, "test_case", module(test("".join(f"      {line}\n" for line in self.PASS)))
            )
        self.assertEqual(0, result.returncode, result.stdout + result.stderr)
        self.assertIn("OK (1 tests, 0 disabled)", result.stdout)

    def test_failing(self):
        tests = [test(f"      {line}\n", f"test_{i}") for i, line in enumerate(self.FAIL)]
        text = module("".join(tests))
        with tempfile.TemporaryDirectory() as folder:
            result = compile_and_run(folder, "test_case", text)
        self.assertEqual(2, result.returncode, result.stdout + result.stderr)
        self.assertIn(f"Tests run: {len(self.FAIL)}, Failures: {len(self.FAIL)},", result.stdout)
        self.assertIn("Encountered 1 or more failures/errors during testing", result.stdout)
        for number, line in enumerate(text.splitlines(), 1):
            if "@assert" in line:
                self.assertIn(f"[test_case.pf:{number}]", result.stdout)
        self.assertIn("1.0000000000000000 should equal 2.0000000000000000 at (2, 2)", result.stdout)

    def test_an_assertion_that_fails_ends_its_test(self):
        text = module(test("      @assertTrue(.false.)\n      @assertFail('not reached')\n"))
        with tempfile.TemporaryDirectory() as folder:
            result = compile_and_run(folder, "test_case", text)
        self.assertNotIn("not reached", result.stdout)

    def test_wrong_kinds_do_not_compile(self):
        for line in ("@assertEqual(1.0d0, 1)", "@assertEqual(1.0d0, 1.0d0, 'text')", "@assertEqual(1.0d0, 1.0)"):
            with tempfile.TemporaryDirectory() as folder, self.subTest(line):
                try:
                    result = compile_and_run(folder, "test_case", module(test(f"      {line}\n")))
                except pfunit_subset.PfError:
                    continue
                self.assertIn("test_case.pf:7", result.stderr)


class TestStructure(unittest.TestCase):
    """Fixtures, parameters, disabled tests, filters."""

    def test_before_after_disable_ifdef_filter(self):
        body = "   @before\n   subroutine prepare()\n      n = n + 1\n   end subroutine prepare\n"
        body += "   @after\n   subroutine clean()\n      n = n - 1\n   end subroutine clean\n"
        body += test("      @assertEqual(1, n)\n", "test_a") + test("      @assertEqual(1, n)\n", "test_b")
        body += test("      @assertFail('disabled')\n", "test_c").replace("@test\n", "@test\n   @disable\n")
        body += test("      @assertFail('left out')\n", "test_d").replace("@test\n", "@test(ifdef=NEVER)\n")
        text = module(body, head="   integer :: n = 0\n")
        with tempfile.TemporaryDirectory() as folder:
            result = compile_and_run(folder, "test_case", text)
            self.assertEqual(0, result.returncode, result.stdout + result.stderr)
            self.assertIn("OK (2 tests, 1 disabled)", result.stdout)
            result = subprocess.run(
                [Path(folder) / "test_case", "-f", "test_b"], capture_output=True, text=True, check=False
            )
            self.assertIn("OK (1 tests, 0 disabled)", result.stdout)

    def test_fixture(self):
        head = "   @testCase\n   type, extends(TestCase) :: fixture_t\n      integer :: n = 0\n   contains\n"
        head += "      procedure :: setUp\n   end type fixture_t\n"
        body = "   subroutine setUp(this)\n      class(fixture_t), intent(inout) :: this\n"
        body += "      this%n = 5\n   end subroutine setUp\n"
        body += "   @test\n   subroutine test_n(this)\n      class(fixture_t), intent(inout) :: this\n"
        body += "      @assertEqual(5, this%n)\n   end subroutine test_n\n"
        with tempfile.TemporaryDirectory() as folder:
            result = compile_and_run(folder, "test_case", module(body, head=head))
            self.assertIn("OK (1 tests, 0 disabled)", result.stdout, result.stderr)
            wrong = body.replace(
                "class(fixture_t), intent(inout) :: this\n      @", "class(TestCase), intent(inout) :: this\n      @"
            )
            result = compile_and_run(folder, "test_case", module(wrong, head=head))
            self.assertIn("Error", result.stderr)

    def test_parameters(self):
        text = (HERE / "test_parameters.pf").read_text(encoding="utf-8")
        with tempfile.TemporaryDirectory() as folder:
            result = compile_and_run(folder, "test_parameters", text)
        self.assertEqual(2, result.returncode, result.stdout + result.stderr)
        self.assertIn("Tests run: 3, Failures: 1,", result.stdout)
        self.assertIn("Failure in: test_parameters_suite.test_square[3]", result.stdout)


class TestRefusals(unittest.TestCase):
    """What pFUnit would not take, or silently not run, is refused with file and line."""

    CASES = (
        (7, "trailing comment", module(test("      @assertTrue(.true.) ! why\n"))),
        (7, "one line", module(test("      @assertTrue( &\n      .true.)\n"))),
        (7, "begin its line", module(test("      if (.true.) @assertTrue(.true.)\n"))),
        (7, "not in the subset", module(test("      @assertAlmost(1, 1)\n"))),
        (7, "not in the subset", module(test("      @assertIsInfinite(1.0)\n"))),
        (7, "needs 2 arguments", module(test("      @assertEqual(1)\n"))),
        (7, "needs 3 arguments", module(test("      @assertRelativelyEqual(1.0, 1.0)\n"))),
        (7, "message=", module(test("      @assertEqual(1, 1, 'text')\n"))),
        (8, "OpenMP", module(test("      !$omp parallel\n      @assertTrue(.true.)\n      !$omp end parallel\n"))),
        (5, "not in the subset", module(test("").replace("@test", "@mpiTest"))),
        (5, "no option", module(test("").replace("@test", "@test(npes=[1])"))),
        (5, "follow @test", module(test("").replace("@test", "@disable\n   @test"))),
        (6, "between @before", module(test("").replace("@test", "@before\n   @test"))),
        (6, "`subroutine` line", module(test("").replace("subroutine test_it()", "pure subroutine test_it()"))),
        (6, "no argument", module(test("").replace("test_it()", "test_it(this)"))),
        (6, "longer than 44", module(test("", "test_" + 40 * "x"))),
        (1, "must be called test_case", module(test(""), name="other")),
        (1, "trailing comment", module(test("")).replace("module test_case\n   use", "module test_case ! why\n   use")),
        (5, "no @test", module("")),
        (
            5,
            "nothing follows",
            module("").replace("contains\n", "contains\n@test\n").replace("end module test_case\n", ""),
        ),
        (5, "`type` line", module(test(""), head="   @testCase\n   integer :: n\n")),
    )

    def test_refusals(self):
        for line, words, text in self.CASES:
            with tempfile.TemporaryDirectory() as folder, self.subTest(words):
                with self.assertRaises(pfunit_subset.PfError) as raised:
                    translate(folder, "test_case", text)
                self.assertIn(f"test_case.pf:{line}: error: ", str(raised.exception))
                self.assertIn(words, str(raised.exception))

    def test_names_that_pfunit_has_too(self):
        text = module(test("      call run()\n") + "   subroutine run()\n   end subroutine run\n")
        with tempfile.TemporaryDirectory() as folder:
            self.assertIn("Error", compile_and_run(folder, "test_case", text).stderr)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    for option in vars(OPTIONS):
        parser.add_argument(f"--{option}", required=True)
    _, rest = parser.parse_known_args(namespace=OPTIONS)
    unittest.main(argv=[sys.argv[0], *rest])
