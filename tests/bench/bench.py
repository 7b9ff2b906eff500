"""Measure rfem on this machine: tables on standard output, figures, page and roofline in build/bench.

    ./run bench [--quick] [--long] [--only NAME,..] [--peers] [--publish]

Parts (--only): step, look, event, growth, memory, files, runs, direct. Parts that are left out keep the figures of the
last run, each with its date, program and the cores that other work held. It is no test: nothing fails because a machine
is slow.
"""

import argparse
import json
import os
import shutil
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
        self.pages = self.work / "quick" if self.quick else self.work
        self.pages.mkdir(parents=True, exist_ok=True)
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
            stdout=subprocess.PIPE,
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
            say(log)
            raise subprocess.CalledProcessError(process.returncode, command)
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
    sizes = {}
    for line in subprocess.run(["lscpu", "-B", "-C"], capture_output=True, text=True, check=False).stdout.splitlines():
        words = line.split()
        if len(words) > 1 and words[1].isdigit():
            sizes[words[0]] = int(words[1])
    memory = Path("/proc/meminfo").read_text(encoding="utf-8").splitlines()[0].split()[1]
    version = subprocess.run([str(bench.rfem), "--version"], capture_output=True, text=True, check=True).stdout
    return {
        "processor": fields.get("Model name", "unknown"),
        "identity": ", ".join(f"{name.lower()} {fields[name]}" for name in ("CPU family", "Model") if name in fields),
        "cores": os.cpu_count(),
        "caches": ", ".join(
            f"{name[:-6]} {fields[name]}" for name in ("L1d cache", "L2 cache", "L3 cache") if name in fields
        ),
        "cache_bytes": {level: sizes.get(level, usual) for level, usual in (("L2", 2**20), ("L3", 2**25))},
        "memory_gib": int(memory) / 2**20,
        "system": first_line(["uname", "-sr"]),
        "compiler": first_line(["gfortran", "--version"]),
        "version": version.splitlines()[0],
        "flags": version.splitlines()[1].removeprefix("flags: "),
    }


def work_of_others():
    """Processor time that has gone to others than this program and what it has called [s]."""
    ticks = Path("/proc/stat").read_text(encoding="utf-8").split("\n", 1)[0].split()[1:]
    user, nice, system, _, _, interrupts, soft, stolen = (int(tick) for tick in ticks[:8])
    own = os.times()
    everything = (user + nice + system + interrupts + soft + stolen) / os.sysconf("SC_CLK_TCK")
    return everything - (own.user + own.system + own.children_user + own.children_system)


def main():
    """Measure, print, write."""
    parser = argparse.ArgumentParser(prog="./run bench", description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="up to 100,000 elements, small runs: about five minutes")
    parser.add_argument("--long", action="store_true", help="also the beam with h = 1, the block with h = 2 and 1")
    parser.add_argument("--only", default="", metavar="NAME,..", help="these parts: " + ", ".join(bench_cases.PARTS))
    parser.add_argument("--peers", action="store_true", help="install Akantu into build/bench/venv and measure it too")
    parser.add_argument("--publish", action="store_true", help="make the page docs/performance.md (all parts measured)")
    options = parser.parse_args()
    wanted = [name for name in options.only.split(",") if name] or list(bench_cases.PARTS)
    unknown = set(wanted) - set(bench_cases.PARTS)
    if unknown:
        parser.error(f"no part {', '.join(sorted(unknown))} (there are {', '.join(bench_cases.PARTS)})")
    if options.publish and options.quick:
        parser.error("--publish wants the whole benchmark, not --quick")
    bench = Bench(options)
    stored = bench.pages / "bench.json"
    if stored.exists():
        bench.figures = json.loads(stored.read_text(encoding="utf-8"))
    bench.figures["machine"] = machine(bench)
    failed = [name for name in wanted if not measured(bench, stored, name, bench_cases.PARTS[name])]
    if options.peers and not measured(bench, stored, "peers", bench_cases.peers):
        failed.append("peers")
    print(bench_report.tables(bench.figures))
    bench_report.write(bench.figures, bench.pages)
    print(f"written: {bench.pages / 'performance.md'}, figures: {stored}")
    missing = [name for name in bench_cases.PARTS if name not in bench.figures]
    if options.publish and missing:
        sys.exit("bench: docs/performance.md stays as it is: not measured: " + ", ".join(missing))
    if options.publish:
        for name in ("performance.md", "performance_roofline.png"):
            shutil.copy(bench.pages / name, ROOT / "docs" / name)
        print("published: docs/performance.md")
    if failed:
        sys.exit("bench: these parts ended with an error: " + ", ".join(failed))


def measured(bench, stored, name, part):
    """Measure a part and store its figures, with when and what they were measured on; whether it came to its end."""
    say(f"== {name}")
    stamp = {"date": datetime.now().astimezone().isoformat(timespec="minutes")}
    stamp["version"] = bench.figures["machine"]["version"]
    start, others_before = time.monotonic(), work_of_others()
    try:
        figures = part(bench)
        if name == "step":
            bench.figures["bandwidth"] = {threads: bench.measure("triad", threads) for threads in ("1", "2")}
    except (subprocess.CalledProcessError, OSError) as error:
        say(f"bench: {name}: {error}")
        bench.figures.pop(name, None)
        return False
    stamp["others"] = max(0.0, work_of_others() - others_before) / (time.monotonic() - start)
    if stamp["others"] > 0.1:
        say(f"   other work held {stamp['others']:.1f} cores meanwhile: the figures are lower than they could be")
    bench.figures[name] = figures
    bench.figures.setdefault("measured", {})[name] = stamp
    stored.write_text(json.dumps(bench.figures, indent=1) + "\n", encoding="utf-8")
    return True


if __name__ == "__main__":
    main()
