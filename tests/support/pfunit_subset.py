#!/usr/bin/env python3
"""A small stand-in for pFUnit's preprocessor, for machines where pFUnit is not installed.

    pfunit_subset.py test IN.pf OUT.F90             a test file -> Fortran, ending in the subroutine NAME_suite
    pfunit_subset.py assertions OUT.f90             the module funit_assertions
    pfunit_subset.py driver OUT.f90 NAME [NAME..]   a main program that runs these suites

Whatever pFUnit 4 would refuse, or would silently not run, is refused here with file and line.
"""

import re
import sys
from itertools import product
from pathlib import Path

# assertion -> number of operands that it needs
ASSERTIONS = {
    name.lower(): (name, operands)
    for operands, names in {
        0: "ExceptionRaised",
        1: "Fail True False All Any None NotAll IsNaN IsFinite",
        2: "Equal NotEqual LessThan LessThanOrEqual GreaterThan GreaterThanOrEqual SameShape",
        3: "RelativelyEqual",
    }.items()
    for name in names.split()
}
OPTIONS = {"test": {"ifdef", "ifndef", "testparameters"}, "testcase": {"constructor", "testparameters"}}
LONGEST_TEST_NAME = 44  # longer ones overrun a name that pFUnit makes of them


class PfError(Exception):
    """A line that pFUnit would not take."""


# ------------------------------------------------------------------------------------------------ lines
def code_of(line):
    """The line without its trailing comment and blanks; texts in quotes are kept."""
    quote = ""
    for i, character in enumerate(line):
        if quote:
            quote = "" if character == quote else quote
        elif character in "'\"":
            quote = character
        elif character == "!":
            return line[:i].strip()
    return line.strip()


def split_arguments(text):
    """Top-level arguments of an argument list."""
    arguments, depth, quote, start = [], 0, "", 0
    for i, character in enumerate(text):
        if quote:
            quote = "" if character == quote else quote
        elif character in "'\"":
            quote = character
        elif character in "([{":
            depth += 1
        elif character in ")]}":
            depth -= 1
        elif character == "," and depth == 0:
            arguments.append(text[start:i].strip())
            start = i + 1
    if text[start:].strip():
        arguments.append(text[start:].strip())
    return arguments


def outside_quotes(line):
    """The code of a line with everything in quotes blanked out."""
    return re.sub(r"'[^']*'|\"[^\"]*\"", lambda m: "_" * len(m[0]), code_of(line))


# ------------------------------------------------------------------------------------------------ a test file
class Translation:
    """One .pf file on its way to Fortran."""

    def __init__(self, path):
        self.path = Path(path)
        self.name = self.path.stem
        self.line_number = 0
        self.output = [f'#line 1 "{path}"']
        self.module = None
        self.tests = []  # dictionaries: name, has_fixture, and the options of @test
        self.case = {}  # type, constructor, parameter, testparameters, setup, teardown
        self.awaited = None  # directive whose subroutine or type line must come next
        self.pending = None  # options of the @test whose subroutine must come next
        self.in_parallel = False

    def refuse(self, text):
        raise PfError(f"{self.path}:{self.line_number}: error: {text}")

    def run(self):
        for line in self.path.read_text(encoding="utf-8").splitlines():
            self.line_number += 1
            if line.lstrip().startswith("@"):
                self.directive(line.strip())
            else:
                self.fortran(line)
        self.check_whole_file()
        return "\n".join(self.output + self.suite()) + "\n"

    def check_whole_file(self):
        if self.awaited:
            self.refuse(f"nothing follows @{self.awaited}")
        if self.module is None:
            self.refuse("tests must stand in a module (its line without a trailing comment)")
        if not self.tests:
            self.refuse("no @test in this file")
        if "type" in self.case and ("setup" in self.case or "teardown" in self.case):
            self.refuse("@before and @after are ignored beside @testCase: override setUp and tearDown")
        if "parameter" in self.case and "type" not in self.case:
            self.refuse("@testParameter needs a @testCase")

    # ---- ordinary lines
    def fortran(self, line):
        code = code_of(line)
        if "@" in outside_quotes(line):
            self.refuse("a directive must begin its line (not behind `if (..)`)")
        sentinel = re.match(r"!\$omp\s+(end\s+)?parallel\b", line.strip(), re.IGNORECASE)
        if sentinel:
            self.in_parallel = not sentinel[1]
        if code and self.awaited:
            self.take_awaited(code)
        module = re.match(r"module\s+(?!procedure\b)(\w+)$", code, re.IGNORECASE)
        if module:
            self.take_module(line, module[1])
        self.output.append(line)

    def take_module(self, line, name):
        if "!" in line:
            self.refuse("the module line must not have a trailing comment")
        if self.module:
            self.refuse("only one module in a file")
        if name.lower() != self.name.lower():
            self.refuse(f"the module must be called {self.name} as the file is, not {name}")
        self.module = name

    def take_awaited(self, code):
        word, self.awaited = self.awaited, None
        if word in ("testcase", "testparameter"):
            found = re.match(r"type\b(?:.*::\s*|\s+)(\w+)$", code, re.IGNORECASE)
            if not found:
                self.refuse(f"the line after @{word} must be the `type` line")
            self.case["type" if word == "testcase" else "parameter"] = found[1]
            return
        found = re.match(r"subroutine\s+(\w+)\s*(\([\w\s,]*\))?$", code, re.IGNORECASE)
        if not found:
            self.refuse(f"the line after @{word} must be the `subroutine` line")
        arguments = split_arguments((found[2] or "()").strip()[1:-1])
        if word == "test":
            self.take_test(found[1], arguments)
        elif arguments:
            self.refuse(f"the subroutine of @{word} has no arguments")
        else:
            self.case["setup" if word == "before" else "teardown"] = found[1]

    def take_test(self, name, arguments):
        if len(name) > LONGEST_TEST_NAME:
            self.refuse(f"the name {name} is longer than {LONGEST_TEST_NAME} characters")
        if len(arguments) != (1 if "type" in self.case else 0):
            self.refuse("a test has no argument, or with @testCase one: the fixture")
        self.pending["name"] = name
        self.tests.append(self.pending)
        self.pending = None

    # ---- directives
    def directive(self, line):
        if code_of(line) != line or line.endswith("&"):
            self.refuse("a directive stands on one line, without `&` and without a trailing comment")
        found = re.match(r"@(\w+)\s*(?:\((.*)\))?$", line)
        if not found:
            self.refuse(f"malformed directive: {line}")
        word, text = found[1].lower(), found[2] or ""
        if self.awaited and not (word == "disable" and self.awaited == "test"):
            self.refuse(f"@{word} between @{self.awaited} and its subroutine or type line")
        if word.startswith("assert"):
            self.assertion(word[len("assert") :], text)
            return
        if word == "disable":
            if self.awaited != "test":
                self.refuse("@disable must follow @test")
            self.pending["disable"] = ""
        elif word in ("test", "before", "after", "testcase", "testparameter"):
            self.awaited = word
            options = self.options(word, text)
            if word == "test":
                self.pending = options
            elif word == "testcase":
                self.case.update(options)
        else:
            self.refuse(f"@{found[1]} is not in the subset of pFUnit that this project uses")
        self.output.append("!" + line)

    def options(self, word, text):
        options = {}
        for argument in split_arguments(text):
            key, _, value = (part.strip() for part in argument.partition("="))
            if key.lower() not in OPTIONS.get(word, ()):
                self.refuse(f"@{word} has no option {key} in the subset of pFUnit that this project uses")
            if key.lower() == "testparameters" and not re.fullmatch(r"\{.+\}", value):
                self.refuse("testParameters must be written {expression}")
            options[key.lower()] = value
        return options

    def assertion(self, word, text):
        if word not in ASSERTIONS:
            self.refuse(f"@assert{word} is not in the subset of pFUnit that this project uses")
        if self.in_parallel:
            self.refuse("an assertion returns from its procedure: not inside an OpenMP region")
        name, needed = ASSERTIONS[word]
        arguments = split_arguments(text)
        if len(arguments) < needed:
            self.refuse(f"@assert{name} needs {needed} arguments")
        if needed > 1 and any(argument[:1] in "'\"" for argument in arguments[2:]):
            self.refuse("write message='...': the third argument is the tolerance")
        separator = ", " if arguments else ""
        self.output += [
            f'#line {self.line_number} "{self.path}"',
            f"  call assert{name}({text}{separator}location=SourceLocation('{self.path.name}', {self.line_number}))",
            "  if (anyExceptions()) return",
            f'#line {self.line_number + 1} "{self.path}"',
        ]

    # ---- the suite
    def suite(self):
        lines = [
            f'#line 1 "generated from {self.path.name}"',
            f"subroutine {self.name}_suite()",
            "   use funit, only: anyExceptions",
            "   use funit_runner, only: begin_test, end_test, skip_test",
            f"   use {self.module}",
            "   implicit none",
        ]
        if "type" in self.case:
            lines += self.fixture_declarations()
        for test in self.tests:
            call = self.fixture_test(test) if "type" in self.case else self.plain_test(test)
            if "disable" in test:
                call = [f"   call skip_test('{self.name}_suite.{test['name']}')"]
            for key in {"ifdef", "ifndef"} & test.keys():
                call = [f"#{key} {test[key]}", *call, "#endif"]
            lines += call
        return [*lines, f"end subroutine {self.name}_suite"]

    def fixture_declarations(self):
        case = self.case["type"]
        lines = [
            "   abstract interface",
            "      subroutine pf_method(this)",
            f"         import :: {case}",
            f"         class({case}), intent(inout) :: this",
            "      end subroutine pf_method",
            "   end interface",
            "   procedure(pf_method), pointer :: pf_run",
            "   integer :: pf_i",
        ]
        if "parameter" in self.case:
            lines.append(f"   type({self.case['parameter']}), allocatable :: pf_parameters(:)")
        return lines

    def plain_test(self, test):
        lines = [f"   if (begin_test('{self.name}_suite.{test['name']}')) then"]
        if "setup" in self.case:
            lines.append(f"      call {self.case['setup']}()")
        lines += ["      if (.not. anyExceptions()) then", f"         call {test['name']}()"]
        if "teardown" in self.case:
            lines.append(f"         call {self.case['teardown']}()")
        return [*lines, "      end if", "      call end_test()", "   end if"]

    def fixture_test(self, test):
        case, parameter = self.case["type"], self.case.get("parameter")
        constructor = self.case.get("constructor", parameter)
        label, count, argument = f"'{self.name}_suite.{test['name']}'", "1", ""
        lines = [f"   pf_run => {test['name']}"]
        if parameter:
            values = test.get("testparameters", self.case.get("testparameters"))
            if values is None:
                self.refuse(f"{test['name']}: no testParameters, neither at @test nor at @testCase")
            lines.append(f"   pf_parameters = {values[1:-1]}")
            label = f"'{self.name}_suite.{test['name']}['//pf_parameters(pf_i)%toString()//']'"
            count, argument = "size(pf_parameters)", "pf_parameters(pf_i)"
        lines += [f"   do pf_i = 1, {count}", "      block", f"         type({case}) :: pf_case"]
        lines.append(f"         if (begin_test({label})) then")
        if constructor:
            lines.append(f"            pf_case = {constructor}({argument})")
        if parameter:
            lines += ["            if (allocated(pf_case%testParameter)) deallocate (pf_case%testParameter)"]
            lines += [f"            allocate (pf_case%testParameter, source={argument})"]
        return lines + [
            "            call pf_case%setUp()",
            "            if (.not. anyExceptions()) then",
            "               call pf_run(pf_case)",
            "               call pf_case%tearDown()",
            "            end if",
            "            call end_test()",
            "         end if",
            "      end block",
            "   end do",
        ]


# ------------------------------------------------------------------------------------------------ the assertions
KINDS = {
    "real32": "real(real32)",
    "real64": "real(real64)",
    "int8": "integer(int8)",
    "int32": "integer(int32)",
    "int64": "integer(int64)",
}
DIMENSIONS = ["", "(:)", "(:, :)", "(:, :, :)"]
# ranks and kinds of expected and actual; what is used less is there for assertEqual only: the module stays small
RANKS = [(0, 0), (0, 1), (1, 1), (0, 2), (2, 2)]
MORE_RANKS = [(0, 3), (3, 3)]
PAIRS = [("real64", "real64"), ("real32", "real64"), ("int32", "real64"), ("int32", "int32"), ("int32", "int64")]
PAIRS += [("int64", "int64")]
MORE_PAIRS = [("real32", "real32"), ("int32", "int8"), ("int8", "int8")]
OPERATIONS = {
    "assertEqual": "equal",
    "assertNotEqual": "not_equal",
    "assertLessThan": "less",
    "assertLessThanOrEqual": "less_or_equal",
    "assertGreaterThan": "greater",
    "assertGreaterThanOrEqual": "greater_or_equal",
    "assertRelativelyEqual": "relatively_equal",
}


def tolerances(operation, actual):
    """Kinds of tolerance that an assertion takes for this kind of actual value; None: it stands without one."""
    if actual.startswith("int"):
        return [] if operation == "relatively_equal" else [None]
    if operation == "relatively_equal":
        return ["real32", actual] if actual != "real32" else ["real32"]
    if operation in ("equal", "not_equal"):
        return [None, *tolerances("relatively_equal", actual)]
    return [None]


def flat(name, rank, conversion):
    """A value of any rank as an array of rank 1."""
    value = conversion.format(name)
    return f"[{value}]" if rank == 0 else value if rank == 1 else f"reshape({value}, [size({name})])"


def procedure(name, operation, kinds, ranks, tolerance):
    """One specific procedure of a generic assertion."""
    is_real = kinds[1].startswith("real")
    conversion = "real({}, real64)" if is_real else "int({}, int64)"
    lines = [f"   subroutine {name}(expected, actual, {'tolerance, ' if tolerance else ''}message, location)"]
    for argument, kind, rank in zip(("expected", "actual"), kinds, ranks):
        lines.append(f"      {KINDS[kind]}, intent(in) :: {argument}{DIMENSIONS[rank]}")
    if tolerance:
        lines.append(f"      {KINDS[tolerance]}, intent(in) :: tolerance")
    lines += [
        "      character(len=*), intent(in), optional :: message",
        "      type(SourceLocation), intent(in), optional :: location",
        f"      call compare_{'reals' if is_real else 'integers'}({operation}, &",
        f"         {flat('expected', ranks[0], conversion)}, &",
        f"         {flat('actual', ranks[1], conversion)}, shape(expected), shape(actual), &",
    ]
    if is_real:
        lines.append(f"         {'real(tolerance, real64)' if tolerance else '0.0_real64'}, &")
    return [*lines, "         message, location)", f"   end subroutine {name}", ""]


def assertions():
    """The module funit_assertions: every generic with its specific procedures."""
    interfaces, bodies = [], []
    for generic, operation in OPERATIONS.items():
        interfaces.append(f"   interface {generic}")
        everything = operation == "equal"
        for kinds, ranks in product(PAIRS + everything * MORE_PAIRS, RANKS + everything * MORE_RANKS):
            for tolerance in tolerances(operation, kinds[1]):
                name = "_".join([operation, *kinds, f"{ranks[0]}{ranks[1]}"] + ([tolerance] if tolerance else []))
                interfaces.append(f"      module procedure {name}")
                bodies += procedure(name, operation, kinds, ranks, tolerance)
        interfaces += [f"   end interface {generic}", ""]
    head = [
        "!> Assertions on numbers, for all kinds and ranks (generated by pfunit_subset.py).",
        "module funit_assertions",
        "   use, intrinsic :: iso_fortran_env, only: int8, int32, int64, real32, real64",
        "   use funit_compare, only: compare_reals, compare_integers, &",
        f"      {', '.join(OPERATIONS.values())}",
        "   use funit_exceptions, only: SourceLocation",
        "   implicit none",
        "   private",
        *(f"   public :: {generic}" for generic in OPERATIONS),
        "",
    ]
    return "\n".join([*head, *interfaces, "contains", "", *bodies, "end module funit_assertions", ""])


# ------------------------------------------------------------------------------------------------ the main program
def driver(suites):
    """A main program that runs the suites one after the other."""
    lines = ["program run_tests", "   use funit_runner, only: start_tests, finish_tests", "   implicit none"]
    lines += ["   interface"]
    for suite in suites:
        lines += [f"      subroutine {suite}_suite()", f"      end subroutine {suite}_suite"]
    lines += ["   end interface", "   call start_tests()", *(f"   call {suite}_suite()" for suite in suites)]
    return "\n".join([*lines, "   call finish_tests()", "end program run_tests", ""])


def main(arguments):
    try:
        command, *rest = arguments
        if command == "test":
            source, target = rest
            text = Translation(source).run()
        elif command == "assertions":
            (target,) = rest
            text = assertions()
        elif command == "driver":
            target, *suites = rest
            text = driver(suites)
        else:
            raise ValueError(command)
    except PfError as error:
        sys.exit(str(error))
    except ValueError:
        sys.exit(__doc__)
    Path(target).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
