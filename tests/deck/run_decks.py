#!/usr/bin/env python3
"""Check that rfem says the right thing about every deck of bad/ and nothing wrong about those of good/.

    run_decks.py --rfem PATH [DECK..]

Each deck is given to `rfem DECK --check` in an empty folder, which must stay empty. Comment lines of the deck (or of a
file DECK.expect beside it, where a comment would spoil the case) say what must come of it, one message a line:

    ** EXPECT: case.inp:17: *ELASTC is no keyword; did you mean *ELASTIC?   all of it that follows `rfem: error: `
    ** EXPECT-WARNING: ...      ** EXPECT-NOTE: ...                         likewise
    ** EXIT: 3                  exit status (default: 2 in bad/, 0 in good/)
    ** ARGUMENTS: --set H=x     further arguments

Files of the deck's folder are named without their folder. Errors must be exactly those expected; so must warnings and
notes in good/, and in bad/ if any is expected.
"""

import argparse
import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
KINDS = {"EXPECT": "error", "EXPECT-WARNING": "warning", "EXPECT-NOTE": "note"}
# what a crash looks like: a user's mistake must never end in one
CRASH = re.compile(r"Fortran runtime error|Backtrace for this error|Sanitizer|runtime error:|Error termination")


def expectations(deck):
    """What the deck's comments say: messages by kind, exit status (None: the default), arguments."""
    text = deck.read_bytes().decode("utf-8", errors="replace")
    sidecar = deck.with_name(deck.name + ".expect")
    if sidecar.exists():
        text += "\n" + sidecar.read_text(encoding="utf-8")
    messages = {kind: [] for kind in KINDS.values()}
    status, arguments = None, []
    for line in text.splitlines():
        found = re.match(r"\*\*\s*([A-Z-]+):\s*(.*?)\s*$", line)
        if not found:
            continue
        word, rest = found.groups()
        if word in KINDS:
            messages[KINDS[word]].append(rest)
        elif word == "EXIT":
            status = int(rest)
        elif word == "ARGUMENTS":
            arguments = shlex.split(rest)
    return messages, status, arguments


def said(stderr, folder):
    """The messages on stderr by kind, files named without the deck's folder."""
    messages = {kind: [] for kind in KINDS.values()}
    for line in stderr.splitlines():
        found = re.match(r"rfem: (error|warning|note): (.*?)\s*$", line)
        if found:
            messages[found[1]].append(found[2].replace(f"{folder}/", ""))
    return messages


def compare(kind, expected, got):
    """Complaints about messages that are missing or too many."""
    complaints = []
    left = list(got)
    for message in expected:
        if message in left:
            left.remove(message)
        else:
            complaints.append(f"expected {kind}: {message}")
    return complaints + [f"unexpected {kind}: {message}" for message in left]


def check(rfem, deck, is_good):
    """Run one deck; complaints about what came of it."""
    expected, status, arguments = expectations(deck)
    if status is None:
        status = 0 if is_good else 2
    if not is_good and not expected["error"]:
        return ["the deck says no `** EXPECT:`"]
    with tempfile.TemporaryDirectory() as folder:
        try:
            result = subprocess.run(
                [str(rfem), str(deck), "--check", *arguments],
                cwd=folder,
                stdin=subprocess.DEVNULL,
                capture_output=True,
                timeout=120,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return ["no end within 120 s"]
        left_behind = sorted(path.name for path in Path(folder).iterdir())
    stdout, stderr = (stream.decode("utf-8", errors="replace") for stream in (result.stdout, result.stderr))
    complaints = []
    if result.returncode != status:
        complaints.append(f"exit status {result.returncode}, expected {status}")
    if CRASH.search(stdout + stderr):
        complaints.append("crashed")
    if left_behind:
        complaints.append(f"left behind: {', '.join(left_behind)}")
    got = said(stderr, deck.parent)
    for kind, messages in expected.items():
        if kind == "error" or is_good or messages:
            complaints += compare(kind, messages, got[kind])
    if complaints and not any(got.values()):
        complaints += [f"stderr: {line}" for line in stderr.splitlines()[:10]]
    return complaints


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rfem", required=True, type=Path, help="the program")
    parser.add_argument("--folder", default=HERE, type=Path, help="where bad/ and good/ are (default: here)")
    parser.add_argument("decks", nargs="*", type=Path, help="decks to check (default: all of bad/ and good/)")
    options = parser.parse_args(arguments)
    decks = options.decks or sorted(options.folder.glob("bad/*.inp")) + sorted(options.folder.glob("good/*.inp"))
    failed = 0
    for deck in decks:
        deck = deck.resolve()
        complaints = check(options.rfem.resolve(), deck, deck.parent.name == "good")
        failed += bool(complaints)
        if complaints:
            print(f"{deck.parent.name}/{deck.name}:")
            print("".join(f"   {complaint}\n" for complaint in complaints), end="")
    print(f"decks: {len(decks) - failed} passed, {failed} failed")
    if not decks:
        print(f"no deck in {options.folder}/bad and {options.folder}/good")
    return 1 if failed or not decks else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
