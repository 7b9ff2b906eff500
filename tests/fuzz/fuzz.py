#!/usr/bin/env python3
"""Mutated decks: whatever the input, rfem ends in order. ./run fuzz [--runs N] [--seed S] calls this with RFEM set.

    fuzz.py [--runs N] [--seed S] [--first I] [--seconds T] [--output DIR]      run I of seed S is always the same

Every shipped deck is a seed, made small. Each run changes one in a few places (mutate.py) and gives it to the program,
half of them with --check. What must hold: a documented exit status and no signal; no run-time error and no report of a
sanitizer; with exit status 2 a message `rfem: error:` and no file, and the same opinion with --check; results with 0
and 1; an end within 10 s of processor time. What fails is made small, and is kept in DIR (build/fuzz)
with the command that shows it.

A start of the sanitizer build costs more than most of the runs. Where there is a C compiler the program is loaded once
and forked for every run (fork_server.c); what fails is then tried again by itself.
"""

import argparse
import collections
import os
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import zlib
from dataclasses import dataclass, field
from pathlib import Path

from mutate import mutate

SOURCE = Path(os.environ.get("RFEM_SOURCE_DIR", Path(__file__).resolve().parents[2]))
PROGRAM = os.environ.get("RFEM", str(SOURCE / "build" / "sanitize" / "bin" / "rfem"))
CRASH = re.compile(
    rb"Fortran runtime error|Backtrace for this error|Sanitizer|runtime error:|Error termination|Error allocating|"
    rb"Allocation would exceed|^At line \d+ of file",
    re.M,
)
STATUS = (0, 1, 2, 3, 4)  # docs/deck.md, Exit status
SECONDS = 10
WALL_SECONDS = 120  # the machine may be busy
MEGABYTES = 4000
LARGE = 50_000  # elements from which on a run may rightly take long
# the same told by the memory in use, where the program was ended before it said how many: 1.3 million elements while
# cracks are fitted take 880, a small body below 100
LARGE_MEGABYTES = 300
MODES = ("--check", "--check", "--check", "--explain", "", "", "", "-")
# a run is to be short: few steps of relaxation; what a seed says itself stays
SHORT = b"*RELAXATION, MAX ITERATIONS=30, CONTINUE=YES\n"
MOST_ITERATIONS = 200  # of a seed that says how many
# small files that live for a moment
SCRATCH = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
SANITIZERS = f"detect_leaks=0:allocator_may_return_null=1:hard_rss_limit_mb={MEGABYTES}"
# the server watches the memory itself; it need not know where each byte was allocated
SERVER_SANITIZERS = "detect_leaks=0:allocator_may_return_null=1:verify_asan_link_order=0:malloc_context_size=0"


@dataclass
class Case:
    """One run: the files (the first is the deck), and how it is given: an option, nothing, or - for standard input."""

    files: dict
    mode: str
    seed: str = ""
    problem: str = field(default="", compare=False)
    long: bool = field(default=False, compare=False)
    stderr: bytes = field(default=b"", compare=False)


# ------------------------------------------------------------------------------------------------------------- seeds
def shipped_decks():
    """Decks of input/ and those that must be accepted; a file without *STEP is a mesh that others include."""
    for path in [*sorted((SOURCE / "input").rglob("*.inp")), *sorted((SOURCE / "tests/deck/good").glob("*.inp"))]:
        text = path.read_bytes()
        if re.search(rb"^\*STEP", text, re.M | re.I):
            yield path, text


def small_mesh(found):
    """A *MESH with at most 12 cells a side."""
    words = found[2].split(b",")
    if len(words) >= 6:
        for i in (4, 5):
            if re.fullmatch(rb"\s*\d+\s*", words[i]) and int(words[i]) > 12:
                words[i] = b" 12" if i == 4 else b" 6"
    return found[1] + b",".join(words)


def small_deck(text):
    """A deck with a coarse mesh, few divisions and few events."""
    edge = b"8" if b"three_point" in text else b"5"
    text = re.sub(rb"^(H *= *)(\d+)\s*$", lambda m: m[1] + edge, text, flags=re.M)
    text = re.sub(rb"^(N[XY]? *= *)(\d+)\s*$", lambda m: m[1] + b"%d" % min(int(m[2]), 8), text, flags=re.M)
    text = re.sub(
        rb"^(\*RELAXATION[^\n]*MAX ITERATIONS *= *)(\d+)",
        lambda m: m[1] + b"%d" % min(int(m[2]), MOST_ITERATIONS),
        text,
        flags=re.M | re.I,
    )
    limited = b"*RELAXATION, MAX ITERATIONS=%d" % MOST_ITERATIONS
    text = re.sub(rb"^\*RELAXATION(?![^\n]*MAX ITERATIONS)", limited, text, flags=re.M | re.I)
    text = re.sub(rb"^\*FRACTURE(?![^\n]*MAX EVENTS)", b"*FRACTURE, MAX EVENTS=5", text, flags=re.M | re.I)
    return re.sub(rb"(^\*MESH[^\n]*\n)([^*\n][^\n]*)", small_mesh, text, flags=re.M | re.I)


def included_files(path, text):
    """name -> content of what a deck includes; large files are left out."""
    values = dict(re.findall(rb"^(\w+) *= *(\S+)\s*$", text, re.M))
    files = {}
    for name in re.findall(rb"^\*INCLUDE\s*,\s*INPUT\s*=\s*\"?([^\n\"]+)", text, re.M | re.I):
        name = re.sub(rb"<(\w+)>", lambda m: values.get(m[1], b"1"), name.strip()).decode()
        file = path.parent / name
        if file.is_file() and file.stat().st_size < 120_000:
            files[name] = file.read_bytes()
    return files


def load_seeds():
    """name -> files of every deck, small, with what it includes."""
    seeds = {}
    for path, text in shipped_decks():
        text = small_deck(text)
        seeds[str(path.relative_to(SOURCE))] = {"deck.inp": text, **included_files(path, text)}
    return seeds


def make_case(seeds, seed, number):
    """Run `number` of a seed."""
    state = random.Random(f"{seed}:{number}")
    name = state.choice(sorted(seeds))
    others = [seeds[other]["deck.inp"] for other in state.sample(sorted(seeds), 3)]
    case = Case(mutate(state, seeds[name], others), state.choice(MODES), name)
    if case.mode in ("", "-") and not re.search(rb"^\*RELAX", case.files["deck.inp"], re.M | re.I):
        case.files["deck.inp"] = re.sub(
            rb"^\*END STEP", SHORT + b"*END STEP", case.files["deck.inp"], flags=re.M | re.I
        )
    return case


# --------------------------------------------------------------------------------------------------------------- runs
class Server:
    """The program, loaded once and forked for every run (fork_server.c)."""

    def __init__(self, scratch):
        library = Path(scratch) / "fork_server.so"
        source = Path(__file__).with_name("fork_server.c")
        subprocess.run(["cc", "-O1", "-shared", "-fPIC", "-o", library, source, "-ldl"], check=True)
        requests, self.requests = os.pipe()
        self.answers, answers = os.pipe()
        for place, end in ((60, requests), (61, answers)):
            os.dup2(end, place)
            os.close(end)
        settings = {"SERVER": 60, "SECONDS": SECONDS, "WALL_SECONDS": WALL_SECONDS, "MEGABYTES": MEGABYTES}
        self.process = subprocess.Popen(
            [PROGRAM],
            pass_fds=(60, 61),
            env={
                **os.environ,
                "OMP_NUM_THREADS": "1",
                "ASAN_OPTIONS": SERVER_SANITIZERS,
                "LD_PRELOAD": str(library),
                **{f"FORK_{name}": str(value) for name, value in settings.items()},
            },
        )
        os.close(60)
        os.close(61)
        self.answers = os.fdopen(self.answers)

    def run(self, arguments, folder, stdin):
        """Exit status (negative: the signal), standard output, standard error, largest memory [MB]."""
        os.write(self.requests, "\t".join([str(folder), stdin, *arguments]).encode() + b"\n")
        status, megabytes = map(int, self.answers.readline().split())
        with open(folder.parent / "output", "rb") as output, open(folder.parent / "error", "rb") as error:
            return os.waitstatus_to_exitcode(status), output.read(1_000_000), error.read(), megabytes

    def close(self):
        os.close(self.requests)
        self.process.wait()


def limits():
    """No core files; a run that does not end is ended by the system."""
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 1))


def write_files(case, folder):
    for name, text in case.files.items():
        path = folder / "decks" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text)


def command(case):
    """Arguments, as they follow the program's name."""
    deck = [] if case.mode == "-" else ["decks/deck.inp"]
    return [*deck, *([case.mode] if case.mode.startswith("--") else []), "--quiet", "--output", "out"]


def run_directly(arguments, folder, stdin):
    """As Server.run, with a start of its own."""
    with open(folder / stdin, "rb") as deck, tempfile.TemporaryFile() as output, tempfile.TemporaryFile() as error:
        process = subprocess.Popen(
            [PROGRAM, *arguments],
            cwd=folder,
            stdin=deck,
            stdout=output,
            stderr=error,
            preexec_fn=limits,
            env={**os.environ, "OMP_NUM_THREADS": "1", "ASAN_OPTIONS": SANITIZERS},
        )
        status, megabytes = wait_for(process)
        output.seek(0)
        error.seek(0)
        return status, output.read(1_000_000), error.read(), megabytes


def wait_for(process):
    """Exit status (negative: the signal) and largest memory [MB] of a process; one that does not end is ended."""
    began = time.monotonic()
    while True:
        done, status, usage = os.wait4(process.pid, os.WNOHANG)
        if done:
            process.returncode = os.waitstatus_to_exitcode(status)
            return process.returncode, usage.ru_maxrss // 1024
        if time.monotonic() - began > WALL_SECONDS:
            process.kill()
        time.sleep(0.005)


def run(case, folder, server=None):
    """Run a case in an empty folder; (exit status, standard output, standard error, memory [MB], files left)."""
    write_files(case, folder)
    stdin = "decks/deck.inp" if case.mode == "-" else "/dev/null"
    status, log, stderr, megabytes = (server.run if server else run_directly)(command(case), folder, stdin)
    left = [str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()]
    return status, log, stderr, megabytes, [name for name in left if not name.startswith("decks/")]


def problem_of(case, folder, server=None):
    """What is wrong with how the program takes a case, in words that are the same for the same fault; '' if nothing."""
    status, log, stderr, megabytes, left = run(case, folder, server)
    case.stderr, case.long = stderr[-4000:], False
    if status in (-9, -24) or b"SIGXCPU" in stderr:  # the limit of processor time
        case.long = megabytes > LARGE_MEGABYTES or is_long(case, log, folder, server)
        return "" if case.long else "no end"
    crash = CRASH.search(stderr + log)
    if crash:
        where = re.search(rb"in (\w+) /|At line \d+ of file [^\n]*|\.f90:\d+", stderr[crash.start() :])
        return f"crash: {crash[0].decode()} {where[0].decode(errors='replace') if where else ''}"
    if status not in STATUS:
        return f"exit status {status}"
    said = re.search(rb"^rfem: error: \S", stderr, re.M)
    if status and not said:
        return f"exit status {status} without a message"
    if status == 0 and said:
        return "an error and exit status 0"
    if re.search(rb"[\0-\x08\x0b-\x1f\x7f]", stderr):
        return "control characters in a message"
    if left and (status in (2, 3) or case.mode.startswith("--")):
        return f"files left behind with exit status {status}"
    if status in (0, 1) and not case.mode.startswith("--") and not any(name.endswith(".h5") for name in left):
        return f"exit status {status} without results"
    if case.mode == "" and zlib.crc32(case.files["deck.inp"]) % 4 == 0:
        shutil.rmtree(folder / "out", ignore_errors=True)
        checked = run(Case(case.files, "--check"), folder, server)[0]
        if (checked == 2) != (status == 2):
            return f"exit status {status}, but {checked} with --check"
    case.stderr = b"%d" % status
    return ""


def is_long(case, log, folder, server=None):
    """Whether a run may take its time: the mesh is large, or the deck is soon read and the simulation goes on."""
    size = re.search(rb"(\d[\d,]*) (?:elements|triangles)", log)
    if size and int(size[1].replace(b",", b"")) > LARGE:
        return True
    shutil.rmtree(folder / "out", ignore_errors=True)
    return not case.mode.startswith("--") and run(Case(case.files, "--check"), folder, server)[0] == 0


def check(case, server=None):
    """What is wrong with a case; what goes wrong through the server must do so by itself."""
    with tempfile.TemporaryDirectory(prefix="rfem_fuzz_", dir=SCRATCH) as scratch:
        folder = Path(scratch) / "run"
        folder.mkdir()
        case.problem = problem_of(case, folder, server)
    if case.problem and server and not check(case):
        case.problem = "only through the fork server"
    return case.problem


# ----------------------------------------------------------------------------------------------------------- failures
def still_fails(case, files, problem):
    return check(Case(files, case.mode, case.seed)) == problem


def minimised(case, budget=200):
    """The same problem with fewer lines: pieces are left out as long as it stays, at most `budget` runs."""
    files, problem = dict(case.files), case.problem
    for name in sorted(files, key=lambda name: -len(files[name])):
        if name != "deck.inp" and budget > 0:
            budget -= 1
            fewer = {key: text for key, text in files.items() if key != name}
            if still_fails(case, fewer, problem):
                files = fewer
                continue
        lines = files[name].split(b"\n")
        size = max(1, len(lines) // 2)
        while budget > 0 and lines:
            place, shorter = 0, False
            while place < len(lines) and budget > 0:
                fewer = lines[:place] + lines[place + size :]
                budget -= 1
                if still_fails(case, {**files, name: b"\n".join(fewer)}, problem):
                    lines, shorter = fewer, True
                else:
                    place += size
            if size == 1 and not shorter:
                break
            size = max(1, size // 2)
        files[name] = b"\n".join(lines)
    return Case(files, case.mode, case.seed, problem)


def keep(case, number, seed, output):
    """Save a failing case, as it was and minimised; the folder."""
    folder = output / f"failure_seed{seed}_run{number}"
    shutil.rmtree(folder, ignore_errors=True)
    write_files(case, folder / "as_found")
    small = minimised(case, budget=10 if case.problem == "no end" else 200)
    write_files(small, folder)
    stdin = " < decks/deck.inp" if case.mode == "-" else ""
    (folder / "report.txt").write_text(
        f"{case.problem}\nmutated from {case.seed}, seed {seed}, run {number}\n"
        f"cd {folder} && {PROGRAM} {' '.join(command(case))}{stdin}\n\n{case.stderr.decode(errors='replace')}\n"
    )
    return folder


def start_server(scratch):
    """The server, where it can be had: it needs a C compiler and a program that is no script."""
    with open(PROGRAM, "rb") as program:
        if not shutil.which("cc") or program.read(4) != b"\x7fELF":
            return None
    return Server(scratch)


def campaign(options):
    """All runs; the number of those that failed."""
    with tempfile.TemporaryDirectory(prefix="rfem_fuzz_") as scratch:
        server = None if options.direct else start_server(scratch)
        failed = run_all(options, server)
        if server:
            server.close()
        return failed


def run_all(options, server):
    seeds = load_seeds()
    failures, statuses = [], collections.Counter()
    slowest, began = (0.0, 0), time.monotonic()
    options.output.mkdir(parents=True, exist_ok=True)
    number = options.first
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        while number < options.first + options.runs:
            if options.seconds and time.monotonic() - began > options.seconds:
                break
            case = make_case(seeds, options.seed, number)
            start = time.monotonic()
            if check(case, server):
                failures.append(number)
                print(f"run {number} ({case.seed} {case.mode}): {case.problem}", flush=True)
                if len(failures) <= options.most:
                    print(f"   kept in {keep(case, number, options.seed, options.output)}", flush=True)
            else:
                statuses["time out" if case.long else int(case.stderr)] += 1
            slowest = max(slowest, (time.monotonic() - start, number))
            number += 1
            if number % 5000 == 0:
                print(f"{number - options.first} runs, {len(failures)} failed", flush=True)
            if sys.stderr.isatty():
                print(f"\r{number - options.first} runs, {len(failures)} failed", end="", file=sys.stderr)
    except KeyboardInterrupt:  # what was done until then is told
        pass
    ends = ", ".join(f"{count} with {status}" for status, count in sorted(statuses.items(), key=str))
    print(
        f"fuzz: seed {options.seed}, {number - options.first} runs of {len(seeds)} decks, {len(failures)} failed; "
        f"exit status: {ends}; slowest {slowest[0]:.1f} s (run {slowest[1]}), {time.monotonic() - began:.0f} s"
    )
    return len(failures)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=1000, help="how many (default: 1000)")
    parser.add_argument("--seed", default="1", help="of all mutations (default: 1)")
    parser.add_argument("--first", type=int, default=0, help="number of the first run (default: 0)")
    parser.add_argument("--seconds", type=float, default=0, help="stop after so many seconds")
    parser.add_argument("--direct", action="store_true", help="start the program anew for every run")
    parser.add_argument("--most", type=int, default=20, help="failures that are minimised and kept (default: 20)")
    parser.add_argument("--output", type=Path, default=SOURCE / "build" / "fuzz", help="where failures go")
    options = parser.parse_args()
    if not os.access(PROGRAM, os.X_OK):
        parser.error(f"there is no program {PROGRAM}; RFEM says where it is")
    return 1 if campaign(options) else 0


if __name__ == "__main__":
    sys.exit(main())
