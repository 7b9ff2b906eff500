#!/usr/bin/env python3
"""Find members of types that a checkpoint forgets.

state.py FILE.f90 ..

Every type with a procedure `exchange` must either exchange each of its members or name it as derived: in the comment
of `exchange`, in parentheses that begin with "Derived:" (as in "(Derived: name follows from the deck.)"). A member
counts as exchanged where `exchange`, or a procedure of the same file that it calls, mentions it as one of an object of
the type (`self%n`, not the `n` of something else). A member of a type that has no `exchange` of its own is not done
with being mentioned: each member of that type must be, as `self%member%n`, or of an object of that type, or of what
`associate` calls the member. What is wrong is printed, one line each; exit status 1.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

TYPE = re.compile(r"^ *type(?:, *[^:\n]*)? *:: *(\w+) *\n(.*?)^ *end type", re.M | re.S | re.I)
MEMBER_TYPE = re.compile(r" *type *\( *(\w+) *\)", re.I)
ASSOCIATED = re.compile(r"(\w+) *=> *([\w%]+(?:\([^()]*(?:\([^()]*\)[^()]*)*\))?)")
INDEX = r"(?:\([^()]*(?:\([^()]*\)[^()]*)*\))?"
ARCHIVED = {"text_t"}  # types that an archive takes whole
EXCHANGE = re.compile(r"\bexchange\b(?: *=> *(\w+))?")
PROCEDURE = re.compile(
    r"((?:^ *!>[^\n]*\n)*)^ *(?:(?:module|pure|elemental|recursive) )*"
    r"(?:subroutine|function) (\w+)(.*?)^ *end (?:subroutine|function)",
    re.M | re.S | re.I,
)


def parts(body: str) -> list[str]:
    """What a type consists of, and what is bound to it."""
    return re.split(r"^ *contains *$", body, flags=re.M | re.I)


def members_and_types(body: str) -> Iterator[tuple[str, str]]:
    """Names of a type's members, each with its derived type ('' if it is of none)."""
    for line in parts(body)[0].replace("&\n", " ").splitlines():
        code = line.split("!")[0]
        if "::" not in code:
            continue
        names = re.sub(r"\([^()]*\)|\[[^\[\]]*\]", "", re.sub(r"\([^()]*\)", "", code.split("::", 1)[1]))
        kind = MEMBER_TYPE.match(code)
        for name in names.split(","):
            if match := re.match(r" *(\w+)", name):
                yield match[1], kind[1] if kind else ""


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


def plain_types(texts: Sequence[str]) -> dict[str, str]:
    """Types without an `exchange` of their own: name and body."""
    found = {}
    for text in texts:
        for match in TYPE.finditer(text):
            if not any(EXCHANGE.search(re.sub(r"!.*", "", bound)) for bound in parts(match[2])[1:]):
                found[match[1]] = match[2]
    return found


def objects(code: str, kind: str) -> set[str]:
    """What objects of a type are called."""
    declared = re.findall(rf"^ *(?:class|type) *\( *{kind} *\)[^:\n]*:: *([^\n]*)", code, flags=re.M | re.I)
    return {name for names in declared for name in re.findall(r"(\w+) *(?:\([^()]*\))?", names)}


def is_mentioned(code: str, prefixes: set[str], member: str) -> bool:
    """Whether the member of one of these objects is mentioned."""
    return any(re.search(rf"(?<![\w%]){prefix}{INDEX}%{member}\b", code, re.I) for prefix in prefixes)


def forgotten(code: str, prefixes: set[str], body: str, kinds: dict[str, str], derived: set[str]) -> Iterator[str]:
    """Members of a type (and of those within it) that the code does not mention."""
    for member, kind in members_and_types(body):
        if member in derived:
            continue
        if not is_mentioned(code, prefixes, member):
            yield member
        elif kind in kinds and kind not in ARCHIVED:
            within = {f"{prefix}{INDEX}%{member}" for prefix in prefixes} | objects(code, kind)
            for alias, what in ASSOCIATED.findall(code):
                if any(re.fullmatch(place + INDEX, what, re.I) for place in within):
                    within.add(alias)
            yield from (f"{member}%{name}" for name in forgotten(code, within, kinds[kind], kinds, set()))


def complaints(path: Path, text: str, later: str, kinds: dict[str, str] | None = None) -> list[str]:
    """Members of the types of a file that are forgotten.

    `later`: the submodule that holds `exchange`, if any. `kinds`: types without one, of all files (default: of this).
    """
    kinds = plain_types([text]) if kinds is None else kinds
    procedures = {found[2]: (found[1], found[3]) for found in PROCEDURE.finditer(without_interfaces(text + later))}
    problems = []
    for found in TYPE.finditer(text):
        name, body = found[1], found[2]
        binding = parts(body)[1:]
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
            for member in forgotten(code, objects(code, name), body, kinds, derived)
        ]
    return problems


def main(paths: Sequence[str]) -> int:
    """Check files; 1 if something is forgotten."""
    problems = []
    kinds = plain_types([Path(name).read_text() for name in paths])
    for name in paths:
        path = Path(name)
        later = path.with_name(path.stem + "_state.f90")
        problems += complaints(path, path.read_text(), later.read_text() if later.exists() else "", kinds)
    print("\n".join(problems), end="\n" if problems else "")
    return int(bool(problems))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
