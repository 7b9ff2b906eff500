#!/usr/bin/env python3
"""Random sequences of events; what fails is made short. ./run property calls this with RANDOM_EVENTS set.

    property.py [--runs N] [--seed S]      sequences S to S + N - 1; a sequence is a function of its seed

Each sequence splits a random body at random (tests/property/random_events.f90), and everything that must hold is looked
at after every event. Of a sequence that fails, by its own checks or by a crash, the smallest prefix is told, which is
that up to its last event; then attempts before that are left out as long as it fails in the same words, and the command
is shown.
"""

import argparse
import os
import re
import subprocess
import sys
import time

CHUNK = 100  # sequences for one start of the program
BUDGET = 300  # runs that make a sequence shorter


def events(program, *arguments):
    """Exit status, standard output and standard error."""
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, check=False)
    return done.returncode, done.stdout, done.stderr


def problem_of(program, seed, attempts):
    """What fails in a sequence that makes only some attempts (None: all), the last attempt, and all that was said.

    What fails is told in words that are the same for the same fault, '' where nothing does.
    """
    only = ["--only", as_ranges(attempts)] if attempts is not None else []
    status, _, said = events(program, "--seed", seed, "--trace", *only)
    if status == 0:
        return "", 0, said
    found = re.search(r"random_events: seed \d+, attempt (\d+), event \d+: (.*)", said)
    if found:
        return re.sub(r"\d[\d.E+-]*", "#", found[2]), int(found[1]), said
    traced = re.findall(r"^seed \d+, attempt (\d+)", said, re.M)
    return f"crash, exit status {status}", int(traced[-1]) if traced else 0, said


def as_ranges(numbers):
    """[1, 2, 3, 7] -> '1-3,7'; no attempt at all is attempt 0, which there is not."""
    ranges = []
    for number in numbers or [0]:
        if ranges and number == ranges[-1][1] + 1:
            ranges[-1][1] = number
        else:
            ranges.append([number, number])
    return ",".join(str(a) if a == b else f"{a}-{b}" for a, b in ranges)


def shortened(program, seed, words, last):
    """Attempts that are enough for the same fault: pieces of them are left out as long as it stays."""
    attempts, size, budget = list(range(1, last + 1)), max(1, last // 2), BUDGET
    while budget > 0:
        place, shorter = 0, False
        while place < len(attempts) and budget > 0:
            fewer = attempts[:place] + attempts[place + size :]
            budget -= 1
            if problem_of(program, seed, fewer)[0] == words:
                attempts, shorter = fewer, True
            else:
                place += size
        if size == 1 and not shorter:
            break
        size = max(1, size // 2)
    return attempts


def report(program, seed):
    """Say what fails in a sequence, and how it is shown with the fewest events."""
    words, last, said = problem_of(program, seed, None)
    lines = [line for line in said.splitlines() if not re.match(r"seed \d+, ", line)]
    print("\n".join(lines[:8]))
    if not words:
        print(f"   seed {seed} does not fail when it is run alone")
        return
    attempts = shortened(program, seed, words, last)
    made = re.search(r"event (\d+):", problem_of(program, seed, attempts)[2])
    print(f"   smallest prefix: attempts 1 to {last}; of these {len(attempts)} are enough", end="")
    print(f", with {made[1]} events" if made else "")
    print(f"   {program} --seed {seed} --only {as_ranges(attempts)}", flush=True)


def run_chunk(program, first, runs):
    """Sequences that fail and the numbers that the program tells of the others; after a failure the next ones go on."""
    failed, counts = [], []
    while runs > 0:
        status, said, errors = events(program, "--seed", first, "--runs", runs)
        if status == 0:
            counts.append([int(n) for n in re.findall(r"\d+", said.replace("seeds", ""))])
            break
        found = re.search(r"random_events: seed (\d+)", errors)
        if not found:  # it crashed: which one was it?
            _, _, traced = events(program, "--seed", first, "--runs", runs, "--trace")
            found = re.findall(r"^seed (\d+)", traced, re.M)
            bad = int(found[-1]) if found else first
        else:
            bad = int(found[1])
        failed.append(bad)
        report(program, bad)
        runs -= bad - first + 1
        first = bad + 1
    return failed, counts


def campaign(options):
    """All sequences; how many failed."""
    failed, done, began = [], 0, time.monotonic()
    last = options.seed + options.runs
    for first in range(options.seed, last, CHUNK):
        bad, counts = run_chunk(options.program, first, min(CHUNK, last - first))
        failed += bad
        done += sum(numbers[0] for numbers in counts)
        if sys.stderr.isatty():
            made = min(first + CHUNK, last) - options.seed
            print(f"\r{made} sequences, {len(failed)} failed", end="", file=sys.stderr)
        if len(failed) >= options.most:
            print(f"stopped after {len(failed)} failures")
            break
    print(
        f"property: {options.runs} sequences from seed {options.seed}, {done} events, {len(failed)} failed, "
        f"{time.monotonic() - began:.0f} s"
    )
    return len(failed)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=10000, help="how many sequences (default: 10000)")
    parser.add_argument("--seed", type=int, default=1, help="of the first one (default: 1)")
    parser.add_argument("--most", type=int, default=5, help="failures after which it stops (default: 5)")
    parser.add_argument("--program", default=os.environ.get("RANDOM_EVENTS"), help="random_events (RANDOM_EVENTS)")
    options = parser.parse_args()
    if options.runs < 1 or options.seed < 0:
        parser.error("--runs is at least 1, --seed at least 0")
    if not options.program or not os.access(options.program, os.X_OK):
        parser.error(f"there is no program {options.program}; --program or RANDOM_EVENTS says where it is")
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    return 1 if campaign(options) else 0


if __name__ == "__main__":
    sys.exit(main())
