#!/usr/bin/env python3
"""Find members of types that a checkpoint forgets.

state.py FILE.f90 ..

Every type with a procedure `exchange` must either exchange each of its members or name it as derived: in the comment of
`exchange`, in parentheses that begin with "Derived:" (as in "(Derived: name follows from the deck.)"). A member counts
as exchanged where `exchange`, or a procedure of the same file that it calls, mentions it. What is wrong is printed, one
line each; exit status 1.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

TYPE = re.compile(r"^ *type(?:, *[^:\n]*)? *:: *(\w+) *\n(.*?)^ *end type", re.M | re.S | re.I)
EXCHANGE = re.compile(r"\bexchange\b(?: *=> *(\w+))?")
PROCEDURE = re.compile(
    r"((?:^ *!>[^\n]*\n)*)^ *(?:(?:module|pure|elemental|recursive) )*"
    r"(?:subroutine|function) (\w+)(.*?)^ *end (?:subroutine|function)",
    re.M | re.S | re.I,
)


def members(body: str) -> Iterator[str]:
    """Names of a type's members."""
    for line in re.split(r"^ *contains *$", body, flags=re.M | re.I)[0].replace("&\n", " ").splitlines():
        code = line.split("!")[0]
        if "::" not in code:
            continue
        names = re.sub(r"\([^()]*\)|\[[^\[\]]*\]", "", re.sub(r"\([^()]*\)", "", code.split("::", 1)[1]))
        for name in names.split(","):
            if match := re.match(r" *(\w+)", name):
                yield match[1]


def without_interfaces(text: str) -> str:
    """The source without interface blocks: they repeat heads of procedures."""
    return re.sub(r"^ *(?:abstract )?interface\b.*?^ *end interface.*?$", "", text, flags=re.M | re.S | re.I)


def exchanged(name: str, procedures: dict[str, tuple[str, str]], seen: set[str]) -> str:
    """The code of a procedure and of those that it calls in the same file."""
    if name in seen or name not in procedures:
        return ""
    seen.add(name)
    body = procedures[name][1]
    called = set(re.findall(r"\bcall (?:self%|this%)?(\w+)", body))
    return body + "".join(exchanged(other, procedures, seen) for other in sorted(called & procedures.keys()))


def complaints(path: Path, text: str, later: str) -> list[str]:
    """Members of the types of a file that are forgotten. `later`: the submodule that holds `exchange`, if any."""
    procedures = {found[2]: (found[1], found[3]) for found in PROCEDURE.finditer(without_interfaces(text + later))}
    problems = []
    for found in TYPE.finditer(text):
        name, body = found[1], found[2]
        binding = re.split(r"^ *contains *$", body, flags=re.M | re.I)[1:]
        bound = [match for line in binding for match in EXCHANGE.finditer(re.sub(r"!.*", "", line))]
        if not bound or "abstract" in found[0].splitlines()[0]:
            continue
        procedure = bound[0][1] or "exchange"
        if procedure not in procedures:
            problems.append(f"{path}: {name} has no procedure {procedure} here")
            continue
        code = re.sub(r"!.*", "", exchanged(procedure, procedures, set()))
        comment = re.sub(r"\s+", " ", procedures[procedure][0].replace("!>", " "))
        derived = set(re.findall(r"\w+", " ".join(re.findall(r"\(Derived:(.*?)\)", comment))))
        problems += [
            f"{path}: {name}%{member} is neither exchanged nor named as derived"
            for member in members(body)
            if member not in derived and not re.search(rf"%{member}\b", code)
        ]
    return problems


def main(paths: Sequence[str]) -> int:
    """Check files; 1 if something is forgotten."""
    problems = []
    for name in paths:
        path = Path(name)
        later = path.with_name(path.stem + "_state.f90")
        problems += complaints(path, path.read_text(), later.read_text() if later.exists() else "")
    print("\n".join(problems), end="\n" if problems else "")
    return int(bool(problems))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
