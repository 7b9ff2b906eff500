#!/usr/bin/env python3
"""Mutated checkpoints and results: `rfem --restart` ends in order whatever lies there. Called by ./run fuzz --restart.

    fuzz_restart.py [--runs N] [--seed S] [--first I] [--seconds T] [--output DIR]    run I of seed S is always one

Seeds are the files of small runs that were cut. A run changes one of them: bytes of the checkpoint, of the HDF5 results
or of the tables (changed, cut off, put in, zeroed, files exchanged or left out), or through h5py the kind, the size,
the presence of data and groups of the checkpoint; half of these get a checksum that fits, so that what
stands behind the checksum is asked too. What must hold: a documented exit status and no signal, no run-time error, no
report of a sanitizer, an end within 10 s of processor time; with status 3 a message, and the tables as they were; a
checkpoint with another byte and its old checksum is refused. What fails is kept in DIR with the command that shows it.
"""

import argparse
import collections
import os
import random
import re
import shutil
import sys
import tempfile
import time
from pathlib import Path

import fuzz
import h5py
import numpy as np
from sealed import WORDS as SEAL
from sealed import sealed

GOOD = fuzz.SOURCE / "tests" / "deck" / "good"
DECKS = ("output.inp", "softening.inp", "dynamic.inp", "model_change.inp", "loads.inp")
CHECKPOINT = "deck.rst.h5"
TABLES = (".csv", ".dat")


# ------------------------------------------------------------------------------------------------------------- seeds
def make_seeds(folder):
    """name -> files of a run that has written checkpoints, in one folder each."""
    seeds = {}
    for name in DECKS:
        text = fuzz.small_deck((GOOD / name).read_bytes())
        text = re.sub(rb"^\*STEP", b"*RESTART, WRITE\n*STEP", text, count=1, flags=re.M)
        case = fuzz.Case({"deck.inp": text}, "")
        place = folder / name
        place.mkdir()
        status, _, error, _, left = fuzz.run(case, place)
        assert status == 0 and "out/" + CHECKPOINT in left, (name, status, error)
        seeds[name] = {Path(path).name: (place / path).read_bytes() for path in left}
        # the one before the last: from there the run has something to do
        seeds[name][CHECKPOINT] = seeds[name].pop("deck.rst.1.h5", seeds[name][CHECKPOINT])
    return seeds


# ----------------------------------------------------------------------------------------------------------- mutations
def body_of(content):
    """What HDF5 has written."""
    return content[: content.rfind(SEAL)]


def change_bytes(state, content):
    """Bytes changed, cut off, doubled, put in, zeroed."""
    content = bytearray(content)
    for _ in range(state.choice((1, 1, 1, 3, 20))):
        size = len(content)
        place = state.randrange(size + 1) if state.random() < 0.6 else state.randrange(min(size, 4096) + 1)
        length = state.choice((1, 2, 8, 64, 512, 4096))
        kind = state.randrange(6)
        if kind == 0 and place < size:
            content[place] ^= 1 << state.randrange(8)
        elif kind == 1:
            content[place : place + length] = state.randbytes(length)[: max(0, size - place)]
        elif kind == 2:
            content[place : place + length] = bytes(min(length, max(0, size - place)))
        elif kind == 3:
            content[place:place] = content[max(0, place - length) : place]
        elif kind == 4 and state.random() < 0.3:
            del content[place:]
        else:
            content[place : place + 4] = state.choice((b"\xff" * 4, b"\x00" * 4, b"\x7f\xff\xff\xff"))
    return bytes(content)


def items_of(file):
    """All data of a file: (group, name of an attribute or dataset, whether it is a dataset)."""
    found = []

    def visit(_, item):
        if isinstance(item, h5py.Group):
            found.extend((item.name, name, False) for name in item.attrs)
            hard = [name for name in item if isinstance(item.get(name, getlink=True), h5py.HardLink)]
            found.extend((item.name, name, True) for name in hard if isinstance(item[name], h5py.Dataset))

    visit("", file)
    file.visititems(visit)
    return found


KINDS = ("i1", "i2", "<i4", "<i8", "<f4", "<f8", "S8", "S3", "c16")


def of_another_kind(state, old):
    """A value of another kind or number of dimensions; also, where there was a number, none."""
    shape = getattr(old, "shape", None)
    if shape is None:
        return np.zeros((2,) * state.randint(1, 3), "c16")
    choice = state.randrange(3)
    if choice == 0 and shape == ():
        return h5py.Empty(old.dtype)
    if choice == 1:
        return np.zeros((*shape, 1), old.dtype)
    return np.zeros(shape, state.choice([kind for kind in KINDS if np.dtype(kind).itemsize != old.dtype.itemsize]))


def of_another_size(state, old):
    """Longer, shorter, empty, not there, or large without a byte in the file."""
    kind = "<f8" if old is None else old.dtype
    choice = state.randrange(3)
    if choice == 0:
        return {"data": h5py.Empty(np.dtype(kind))}
    if choice == 1:
        return {"data": np.zeros(state.choice(((0,), (1,), (7,), (2, 3), (3, 0), (2**16,))), kind)}
    return {"shape": (2 ** state.randint(20, 33),), "dtype": kind, "chunks": (1024,)}


def change_structure(state, body, forged):
    """Kind, presence and place of data, through h5py. With a checksum that fits (forged) sizes are left alone: whoever
    computes it can make the program believe anything, but what it cannot read it must not read."""
    with tempfile.NamedTemporaryFile(suffix=".h5", dir=fuzz.SCRATCH) as scratch:
        scratch.write(body)
        scratch.flush()
        with h5py.File(scratch.name, "r+", libver=("v110", "v110")) as file:
            for _ in range(state.choice((1, 1, 2, 5))):
                change_item(state, file, forged)
        return Path(scratch.name).read_bytes()


def change_item(state, file, forged):
    group, name, is_dataset = state.choice(items_of(file))
    owner = file[group]
    kind = state.randrange(5)
    if kind == 0 and group != "/":  # a whole group: left out, or a link to itself, to the root, to another file
        parent, last = owner.parent, group.rsplit("/", 1)[1]
        del parent[last]
        if state.random() < 0.5:
            parent[last] = state.choice((h5py.SoftLink(group), h5py.ExternalLink("no.h5", "/")))
    elif not is_dataset:
        old = owner.attrs[name]
        del owner.attrs[name]
        if kind > 1:
            owner.attrs[name] = of_another_kind(state, old)
    else:
        old = owner[name][()] if owner[name].shape is not None else None
        del owner[name]
        if kind == 1:
            owner.attrs[name] = np.int32(3)
        elif kind == 2 and not forged:
            owner.create_dataset(name, **of_another_size(state, old))
        elif kind > 2:
            owner[name] = of_another_kind(state, old)


def mutated(state, seeds):
    """Files of a run, what was done to them, and whether the program must refuse them."""
    name = state.choice(sorted(seeds))
    files = dict(seeds[name])
    what = state.choice(("bytes", "sealed bytes", "structure", "forged", "forged", "results", "exchanged", "missing"))
    old = files[CHECKPOINT]
    refused = True
    if what == "bytes":
        files[CHECKPOINT] = change_bytes(state, old)
        refused = files[CHECKPOINT] != old
    elif what == "sealed bytes":
        files[CHECKPOINT] = sealed(change_bytes(state, body_of(old)))
        refused = False
    elif what == "structure":
        files[CHECKPOINT] = change_structure(state, body_of(old), False) + old[old.rfind(SEAL) :]
    elif what == "forged":
        files[CHECKPOINT] = sealed(change_structure(state, body_of(old), True))
    else:
        which = state.choice(sorted(set(files) - {CHECKPOINT}))
        if what == "results":
            files[which] = change_bytes(state, files[which])
            refused = False  # what the checkpoint does not know may be changed
        elif what == "exchanged":
            which = state.choice((CHECKPOINT, which))
            other = seeds[state.choice(sorted(seeds))]
            files[which] = other[state.choice(sorted(other))]
            refused = False
        else:
            del files[which]
    return name, what, files, refused


# ---------------------------------------------------------------------------------------------------------------- runs
def problem_of(files, refused, folder, server):
    """What is wrong with how the program takes these files; '' if nothing. And the exit status."""
    out = folder / "out"
    out.mkdir(parents=True)
    for name, content in files.items():
        (out / name).write_bytes(content)
    arguments = ["--restart", "out/" + CHECKPOINT, "--quiet"]
    status, log, error, _ = (server.run if server else fuzz.run_directly)(arguments, folder, "/dev/null")
    crash = fuzz.CRASH.search(error + log)
    if crash:
        where = re.search(rb"in (\w+) /|At line \d+ of file [^\n]*|\.f90:\d+", error[crash.start() :])
        return f"crash: {crash[0].decode()} {where[0].decode(errors='replace') if where else ''}", status, error
    if status not in fuzz.STATUS:
        return f"exit status {status}", status, error
    if status and not re.search(rb"^rfem: error: \S", error, re.M):
        return f"exit status {status} without a message", status, error
    if refused and status != 3:
        return f"not refused: exit status {status}", status, error
    changed = [name for name in files if name.endswith(TABLES) and (out / name).read_bytes() != files[name]]
    if refused and changed:
        return f"refused, but {changed[0]} has changed", status, error
    return "", status, error


def keep(output, options, number, what, files, problem, error):
    folder = output / f"restart_seed{options.seed}_run{number}"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name, content in files.items():
        (folder / name).write_bytes(content)
    (folder / "report.txt").write_text(
        f"{problem}\n{what}; seed {options.seed}, run {number}\n"
        f"{fuzz.PROGRAM} --restart {folder / CHECKPOINT} --quiet\n\n" + error.decode(errors="replace")[-4000:]
    )
    return folder


def campaign(options):
    """All runs; the number of those that failed."""
    failed, ends, began = 0, collections.Counter(), time.monotonic()
    with tempfile.TemporaryDirectory(prefix="rfem_fuzz_", dir=fuzz.SCRATCH) as scratch:
        (Path(scratch) / "seeds").mkdir()
        seeds = make_seeds(Path(scratch) / "seeds")
        server = None if options.direct else fuzz.start_server(scratch)
        number = options.first
        while number < options.first + options.runs:
            if options.seconds and time.monotonic() - began > options.seconds:
                break
            state = random.Random(f"{options.seed}:{number}")
            name, what, files, refused = mutated(state, seeds)
            with tempfile.TemporaryDirectory(prefix="run_", dir=scratch) as place:
                problem, status, error = problem_of(files, refused, Path(place) / "run", server)
            if problem:
                failed += 1
                print(f"run {number} ({name}, {what}): {problem}", flush=True)
                if failed <= options.most:
                    folder = keep(options.output, options, number, f"{name}, {what}", files, problem, error)
                    print(f"   kept in {folder}", flush=True)
            ends[what, status] += 1
            number += 1
        if server:
            server.close()
    told = ", ".join(f"{what}: {count} with {status}" for (what, status), count in sorted(ends.items()))
    seconds = time.monotonic() - began
    print(f"fuzz_restart: seed {options.seed}, {number - options.first} runs, {failed} failed; {told}; {seconds:.0f} s")
    return failed


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=1000, help="how many (default: 1000)")
    parser.add_argument("--seed", default="1", help="of all mutations (default: 1)")
    parser.add_argument("--first", type=int, default=0, help="number of the first run (default: 0)")
    parser.add_argument("--seconds", type=float, default=0, help="stop after so many seconds")
    parser.add_argument("--direct", action="store_true", help="start the program anew for every run")
    parser.add_argument("--most", type=int, default=20, help="failures that are kept (default: 20)")
    parser.add_argument("--output", type=Path, default=fuzz.SOURCE / "build" / "fuzz", help="where failures go")
    options = parser.parse_args()
    if not os.access(fuzz.PROGRAM, os.X_OK):
        parser.error(f"there is no program {fuzz.PROGRAM}; RFEM says where it is")
    return 1 if campaign(options) else 0


if __name__ == "__main__":
    sys.exit(main())
