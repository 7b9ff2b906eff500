#!/usr/bin/env python3
"""Check the layout of Fortran files, or repair it: what `fprettify -i 3` makes of them, but for three things.

    format_fortran.py [--fix] FILE..

1. fprettify moves continuation lines under the bracket or operator they belong to; where that does not fit into the
   line length it gives up, and the result depends on what was there. So a continuation line keeps the indentation its
   author gave it, if that is deeper than the statement's. Lines that are too long are fortitude's business (S001).
2. fprettify writes the substring of an array element as `names(i) (1:3)`. `names(i)(1:3)` is left as it is.
3. fprettify takes the blank out of `, .not. x`. It stays.
"""

import argparse
import difflib
import io
import logging
import re
import sys
from pathlib import Path

import fprettify

INDENT = 3
NO_LIMIT = 100_000  # with a limit, fprettify complains of the lines it could not align


def ends_open(line, quote=""):
    """Whether the statement goes on in the next line, and the quote that is open there."""
    code = line
    for i, character in enumerate(line):
        if quote:
            quote = "" if character == quote else quote
        elif character in "'\"":
            quote = character
        elif character == "!":
            code = line[:i]
            break
    is_open = code.rstrip().endswith("&")
    return is_open, quote if is_open else ""


def indentation(line):
    return len(line) - len(line.lstrip(" "))


def mended(line, original):
    """The line with `) (` as the original has it, and with a blank after the comma in `, .not.`."""
    texts = r"'[^']*'|\"[^\"]*\"|!.*"
    was = re.findall(r"\)\s*\(", re.sub(texts, "", original))
    parts = re.split(rf"({texts}|\)\s*\(|,\.not\.)", line)
    joints = [i for i, part in enumerate(parts) if re.fullmatch(r"\)\s*\(", part)]
    if len(joints) == len(was):
        for i, joint in zip(joints, was):
            parts[i] = ")(" if joint == ")(" else parts[i]
    return "".join(", .not." if part == ",.not." else part for part in parts)


def formatted(text, name="text"):
    """The text in our layout."""
    output = io.StringIO()
    fprettify.reformat_ffile(
        io.StringIO(text), output, impose_indent=True, indent_size=INDENT, llength=NO_LIMIT, orig_filename=name
    )
    written = iter(line for line in text.splitlines() if line.strip())
    lines = []
    is_open, quote, statement = False, "", 0
    for line in output.getvalue().splitlines():
        if not line.strip():
            lines.append("")
            continue
        original = next(written)
        line = mended(line, original)
        if is_open and not line.lstrip().startswith("!"):
            indent = indentation(original)
            line = " " * (indent if indent > statement else statement + INDENT) + line.lstrip()
        elif not is_open:
            statement = indentation(line)
        if not line.lstrip().startswith(("!", "#")):
            is_open, quote = ends_open(line, quote)
        lines.append(line.rstrip())
    return "\n".join(lines) + "\n"


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--fix", action="store_true", help="repair instead of showing the differences")
    parser.add_argument("files", nargs="*", type=Path)
    options = parser.parse_args(arguments)
    logging.disable(logging.WARNING)  # fprettify's complaints about lines it cannot align
    wrong = 0
    for path in options.files:
        text = path.read_text(encoding="utf-8")
        better = formatted(text, str(path))
        if better == text:
            continue
        wrong += 1
        if options.fix:
            path.write_text(better, encoding="utf-8")
            print(f"{path}: reformatted")
        else:
            sys.stdout.writelines(
                difflib.unified_diff(
                    text.splitlines(True), better.splitlines(True), str(path), f"{path} (formatted)", n=1
                )
            )
    return 1 if wrong and not options.fix else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
