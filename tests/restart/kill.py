#!/usr/bin/env python3
"""kill -9 at random moments: nothing that was finished is lost, and the run comes to the same end.

    kill.py [--trials N] [--seed S] [--first I]         ./run kill [--trials N] .. calls this with RFEM set

A trial runs a deck that writes a row and a frame for each state, and a checkpoint after each increment. It is killed at
a random moment, gone on with (or begun anew if there was no checkpoint yet), and killed again, up to three times. After
every kill: each row that the log has told is in the tables and each of its frames in the frame files; what rfem-recover
makes of a copy of the files are ordinary ones, with the beginning of what the whole run wrote. At last the run goes on
to its end: digests, tables and all data must be those of the run that nobody killed. Trial I of seed S is the same
always, as far as the machine's speed is.
"""

import argparse
import collections
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import h5py
import rfem_recover
from kept_results import assert_kept, assert_same
from rfem_results import ResultsError, open_results
from rfem_run import BEAM, PROGRAM, edited

MOST_KILLS = 3
ROW = re.compile(r"  (?:start|before event|after event|settled|not converged)$", re.M)
DIGEST = re.compile(r"^digest .*$", re.M)
EDITS = [
    ("FIELD, FREQUENCY=10", "FIELD, FREQUENCY=1"),
    ("\nH = 2\n", "\nH = 4\n"),
    ("*END STEP", "*RESTART, WRITE\n*NODE PRINT, NSET=LOAD\nU, RF\n*END STEP"),
]


class Trials:
    """The run that nobody kills, in a folder below `folder`; trials beside it."""

    def __init__(self, folder):
        self.folder = Path(folder)
        self.deck = edited(BEAM, self.folder, *EDITS, name="j.inp")
        self.whole = self.folder / "whole"
        start = time.monotonic()
        status, log, messages = self.run([self.deck, "--output", self.whole])
        self.seconds = time.monotonic() - start
        assert status == 0, messages
        self.digest = DIGEST.findall(log)
        self.count = collections.Counter()

    def run(self, arguments, wait=None):
        """Exit status, log and messages; killed after so many seconds."""
        with tempfile.TemporaryFile("w+") as log, tempfile.TemporaryFile("w+") as messages:
            process = subprocess.Popen(
                [PROGRAM, *map(str, arguments), "--quiet"],
                stdin=subprocess.DEVNULL, stdout=log, stderr=messages, env={**os.environ, "OMP_NUM_THREADS": "1"},
            )  # fmt: skip
            if wait is not None:
                time.sleep(wait)
                process.kill()
            process.wait(timeout=600)
            log.seek(0)
            messages.seek(0)
            return process.returncode, log.read(), messages.read()

    def trial(self, number, seed="1"):
        """One trial; an AssertionError tells what was lost."""
        folder = self.folder / f"trial{number}"
        shutil.rmtree(folder, ignore_errors=True)
        dice = random.Random(f"{seed} {number}")
        command, known = [self.deck, "--output", folder], 0
        for _ in range(dice.randint(1, MOST_KILLS)):
            status, log, messages = self.run(command, dice.uniform(0.0, 1.0) * self.seconds)
            assert status in (0, -signal.SIGKILL), messages
            if status == 0:
                break
            self.count["kills"] += 1
            self.check(folder, known + len(ROW.findall(log)))
            checkpoint = folder / "j.rst.h5"
            if checkpoint.exists():
                self.count["with a checkpoint"] += 1
                command, known = ["--restart", checkpoint], rows_in(checkpoint)
            else:
                assert not (folder / "j.rst.1.h5").exists(), "the previous checkpoint is alone"
                command, known = [self.deck, "--output", folder], 0
        status, log, messages = self.run(command)
        assert status == 0, messages
        assert DIGEST.findall(log) == self.digest
        assert_same(folder, self.whole)
        shutil.rmtree(folder)

    def check(self, folder, finished):
        """What a killed run has left: at least so many rows and frames."""
        copy = folder.with_name(folder.name + "_copy")
        shutil.rmtree(copy, ignore_errors=True)
        if not (folder / "j.h5").exists():
            assert finished == 0
            return
        shutil.copytree(folder, copy)
        found = counts(copy)
        assert min(found) >= finished, f"{finished} rows were told, {found[0]} rows and {found[1]} frames can be read"
        report = rfem_recover.recover(copy / "j")
        if finished:
            assert not report.lost, report.lost
            rows, frames = assert_kept(copy, self.whole, "j")
            assert rows == found[0] and frames == found[1]
            self.count["rows"] += rows
            self.count["frames"] += frames
        shutil.rmtree(copy)


def rows_in(checkpoint):
    """Rows of the history that a checkpoint knows."""
    with h5py.File(checkpoint) as file:
        return int(file["recorder/history/history"].attrs["rows"])


def counts(folder):
    """Rows, and frames that both files have, as rfem_results reads them before any repair."""
    with open_results(folder / "j") as results:
        try:
            rows = len(results.history)
            return rows, min(len(results.frames), len(results.cracks))
        except (ResultsError, TypeError):  # killed while the files were made
            return 0, 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=30, help="how many (default: 30)")
    parser.add_argument("--seed", default="1", help="of the moments (default: 1)")
    parser.add_argument("--first", type=int, default=0, help="number of the first trial (default: 0)")
    options = parser.parse_args()
    failed = 0
    with tempfile.TemporaryDirectory(prefix="rfem_kill_") as folder:
        trials = Trials(folder)
        for number in range(options.first, options.first + options.trials):
            try:
                trials.trial(number, options.seed)
            except AssertionError as error:
                failed += 1
                print(f"trial {number}: {error}", flush=True)
        count = trials.count
    good = f"{options.trials - failed} of {options.trials} trials good"
    print(f"kill: seed {options.seed}, {good}; a run takes {trials.seconds:.1f} s; {count['kills']} kills,", end=" ")
    print(f"{count['with a checkpoint']} of them with a checkpoint;", end=" ")
    print(f"{count['rows']} rows and {count['frames']} frames compared after them")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
