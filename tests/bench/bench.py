"""Measure rfem on this machine: tables on standard output, build/bench/bench.json, docs/performance.md.

    ./run bench [--quick] [--long] [--only NAME,..] [--peers] [--no-report]

Parts (--only): step, look, event, growth, memory, files, runs, direct. Figures of parts that are left out are taken
from the last bench.json. It is no test: nothing fails because a machine is slow.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from datetime import datetime
from pathlib import Path

import bench_cases
import bench_report

ROOT = Path(__file__).resolve().parents[2]


class Bench:
    """Programs, folders and options of a run of the benchmark, and the figures so far."""

    def __init__(self, options):
        self.options = options
        self.quick = options.quick
        self.rfem = Path(os.environ.get("RFEM", ROOT / "build/release/bin/rfem")).resolve()
        self.program = self.rfem.with_name("rfem_bench")
        self.root = ROOT
        self.work = ROOT / "build" / "bench"
        self.work.mkdir(parents=True, exist_ok=True)
        self.sizes = [10_000, 100_000] if self.quick else [10_000, 100_000, 1_000_000]
        self.figures = {}

    def measure(self, *words):
        """Call rfem_bench; its lines `name value` as a dictionary."""
        environment = dict(os.environ, OMP_WAIT_POLICY="active", OMP_PROC_BIND="true")
        say("  rfem_bench " + " ".join(str(word) for word in words))
        done = subprocess.run(
            [str(self.program), *[str(word) for word in words]],
            check=True,
            env=environment,
            capture_output=True,
            text=True,
        )
        return {name: float(value) for name, value in (line.split() for line in done.stdout.splitlines())}

    def run(self, deck, *words, threads=1):
        """Run a deck; the log, wall time and processor time [s], largest memory [bytes]."""
        folder = self.work / "runs"
        environment = dict(os.environ, OMP_NUM_THREADS=str(threads))
        environment.pop("OMP_WAIT_POLICY", None)  # as users run it: threads that sleep between steps cost half
        command = [str(self.rfem), *[str(word) for word in words], "--output", str(folder), "--quiet", str(deck)]
        say("  rfem " + " ".join(command[1:]))
        start = time.monotonic()
        with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as process:
            log = process.stdout.read()
            _, status, used = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode not in (0, 1):
            sys.exit(f"bench: rfem ended with exit status {process.returncode}:\n{log}")
        return {
            "log": log,
            "seconds": time.monotonic() - start,
            "processor": used.ru_utime + used.ru_stime,
            "memory": used.ru_maxrss * 1024,
        }


def say(text):
    """A line for who waits."""
    print(text, file=sys.stderr, flush=True)


def first_line(command):
    """The first line that a program prints, empty if it cannot be run."""
    try:
        return subprocess.run(command, capture_output=True, text=True, check=False).stdout.splitlines()[0]
    except (OSError, IndexError):
        return ""


def machine(bench):
    """What the figures were measured on."""
    fields = {}
    for line in subprocess.run(["lscpu"], capture_output=True, text=True, check=False).stdout.splitlines():
        name, _, value = line.partition(":")
        fields[name.strip()] = value.strip()
    memory = Path("/proc/meminfo").read_text(encoding="utf-8").splitlines()[0].split()[1]
    version = subprocess.run([str(bench.rfem), "--version"], capture_output=True, text=True, check=True).stdout
    return {
        "processor": fields.get("Model name", "unknown"),
        "identity": ", ".join(f"{name.lower()} {fields[name]}" for name in ("CPU family", "Model") if name in fields),
        "cores": os.cpu_count(),
        "caches": ", ".join(
            f"{name[:-6]} {fields[name]}" for name in ("L1d cache", "L2 cache", "L3 cache") if name in fields
        ),
        "memory_gib": int(memory) / 2**20,
        "system": first_line(["uname", "-sr"]),
        "compiler": first_line(["gfortran", "--version"]),
        "version": version.splitlines()[0],
        "flags": version.splitlines()[1].removeprefix("flags: "),
        "date": datetime.now().astimezone().isoformat(timespec="minutes"),
        "load": os.getloadavg()[0],
    }


def main():
    """Measure, print, write."""
    parser = argparse.ArgumentParser(prog="./run bench", description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="up to 100,000 elements, small runs: about two minutes")
    parser.add_argument("--long", action="store_true", help="also the beam with h = 1, the block with h = 2 and 1")
    parser.add_argument("--only", default="", metavar="NAME,..", help="these parts: " + ", ".join(bench_cases.PARTS))
    parser.add_argument("--peers", action="store_true", help="install Akantu into build/bench/venv and measure it too")
    parser.add_argument("--no-report", action="store_true", help="leave docs/performance.md as it is")
    options = parser.parse_args()
    wanted = [name for name in options.only.split(",") if name] or list(bench_cases.PARTS)
    unknown = set(wanted) - set(bench_cases.PARTS)
    if unknown:
        parser.error(f"no part {', '.join(sorted(unknown))} (there are {', '.join(bench_cases.PARTS)})")
    bench = Bench(options)
    stored = bench.work / ("quick.json" if bench.quick else "bench.json")
    if stored.exists():
        bench.figures = json.loads(stored.read_text(encoding="utf-8"))
    bench.figures["machine"] = machine(bench)
    bench.figures["bandwidth"] = {threads: bench.measure("triad", threads) for threads in ("1", "2")}
    for name in wanted:
        say(f"== {name}")
        bench.figures[name] = bench_cases.PARTS[name](bench)
        stored.write_text(json.dumps(bench.figures, indent=1) + "\n", encoding="utf-8")
    if options.peers:
        bench.figures["peers"] = bench_cases.peers(bench)
        stored.write_text(json.dumps(bench.figures, indent=1) + "\n", encoding="utf-8")
    print(bench_report.tables(bench.figures))
    if not (options.no_report or bench.quick):
        bench_report.write(bench.figures, ROOT / "docs")
        print(f"written: {ROOT / 'docs' / 'performance.md'}")
    print(f"figures: {stored}")


if __name__ == "__main__":
    main()
