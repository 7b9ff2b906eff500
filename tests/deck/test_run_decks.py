#!/usr/bin/env python3
"""The deck runner's own test, with a stand-in for rfem: it must see every way in which a deck can go wrong."""

import contextlib
import io
import tempfile
import unittest
from pathlib import Path

import run_decks

# A program that does what the deck's lines `!command` say.
STAND_IN = """#!/bin/sh
deck=$1
grep '^!' "$deck" | cut -c2- > "$deck.sh"
. "$deck.sh"
"""
ERROR = '!echo "rfem: error: $deck:1: wrong" >&2\n'


class TestRunDecks(unittest.TestCase):
    def run_deck(self, kind, text, sidecar=""):
        """Exit status and output of the runner for one deck."""
        with tempfile.TemporaryDirectory() as name, contextlib.redirect_stdout(io.StringIO()) as output:
            folder = Path(name).resolve()
            rfem = folder / "rfem"
            rfem.write_text(STAND_IN)
            rfem.chmod(0o755)
            (folder / kind).mkdir()
            (folder / kind / "case.inp").write_text(text)
            if sidecar:
                (folder / kind / "case.inp.expect").write_text(sidecar)
            status = run_decks.main(["--rfem", str(rfem), "--folder", str(folder)])
        return status, output.getvalue()

    def assert_passes(self, *arguments):
        self.assertEqual((0, "decks: 1 passed, 0 failed\n"), self.run_deck(*arguments))

    def assert_complains(self, words, *arguments):
        status, output = self.run_deck(*arguments)
        self.assertEqual(1, status)
        self.assertIn(words, output)

    def test_bad_decks(self):
        expect = "** EXPECT: case.inp:1: wrong\n"
        self.assert_passes("bad", expect + ERROR + "!exit 2\n")
        self.assert_passes("bad", expect + "** EXIT: 3\n" + ERROR + "!exit 3\n")
        self.assert_passes("bad", ERROR + "!exit 2\n", expect)
        self.assert_passes("bad", expect + ERROR + '!echo "rfem: note: by the way" >&2\n!exit 2\n')
        arguments = "** ARGUMENTS: -n 'a b'\n" + '![ "$4" = "a b" ] || exit 5\n'
        self.assert_passes("bad", expect + arguments + ERROR + "!exit 2\n")
        self.assert_complains("says no", "bad", ERROR + "!exit 2\n")
        self.assert_complains("exit status 0, expected 2", "bad", expect + ERROR)
        self.assert_complains("expected error: case.inp:1: wrong", "bad", expect + "!exit 2\n")
        self.assert_complains("unexpected error: case.inp:1: wrong", "bad", expect + 2 * ERROR + "!exit 2\n")
        self.assert_complains("crashed", "bad", expect + ERROR + "!echo Fortran runtime error\n!exit 2\n")
        self.assert_complains("left behind: file", "bad", expect + ERROR + "!touch file\n!exit 2\n")

    def test_good_decks(self):
        note = '!echo "rfem: note: by the way" >&2\n'
        self.assert_passes("good", "*HEADING\n")
        self.assert_passes("good", "** EXPECT-NOTE: by the way\n" + note)
        self.assert_complains("unexpected note: by the way", "good", note)
        self.assert_complains("expected warning: careful", "good", "** EXPECT-WARNING: careful\n")
        self.assert_complains("unexpected error", "good", ERROR + "!exit 2\n")

    def test_no_deck_is_a_failure(self):
        with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
            self.assertEqual(1, run_decks.main(["--rfem", "/bin/true", "--folder", folder]))


if __name__ == "__main__":
    unittest.main()
