#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Compares the speed of two trees of the library, call by call, and what they find, in its order.

    benchmarks/compare.py OLD NEW [--instructions | --times] [--only TEXT] [--rounds N]

OLD and NEW are folders of this repository, such as worktrees. The rows of benchmarks/compare/ are
compiled over each. --instructions counts them under callgrind, with AVX2 and SSE4, which takes no
notice of what else the machine does. --times takes both libraries into this process and calls them
by turns; it prints the median of each row's old time over its new one, its 95 % interval, and the
geometric mean. So a ratio above 1 is more instructions, or less time. Without either, both are run.
"""

import argparse
import ctypes
import math
import os
import random
import re
import statistics
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
BUILD = ROOT / "build" / "compare"
SECONDS = 0.004  # that one turn takes at least


def build(name, tree):
    folder = BUILD / name
    options = ["-G", "Ninja", f"-DTREE={Path(tree).resolve()}", "-DCMAKE_BUILD_TYPE=Release"]
    configure = ["cmake", "-S", ROOT / "benchmarks" / "compare", "-B", folder, *options]
    for command in (configure, ["cmake", "--build", folder, "--target", "rows"]):
        subprocess.run(command, check=True, stdout=sys.stderr)
    return folder / "librows.so"


def load(path):
    library = ctypes.CDLL(str(path))
    library.row_name.restype = ctypes.c_char_p
    library.row_open.restype = ctypes.c_uint64
    library.row_found.restype = ctypes.c_int64
    library.row_time.restype = ctypes.c_double
    return library


def row_names(library, only):
    """The rows with this text in their names, by number."""
    names = {}
    while (name := library.row_name(len(names))) is not None:
        names[len(names)] = name.decode()
    return {row: name for row, name in names.items() if only in name}


def count(path, only):
    """Runs under callgrind, which writes a file for each row."""
    library = load(path)
    for row, name in row_names(library, only).items():
        answer = library.row_open(row)
        library.row_count()
        print(row, answer, library.row_found(), name, sep="\t", flush=True)


def counted(path, simd, only):
    """Hash, number of what is found and instructions of each row, by its name."""
    folder = path.parent / simd
    folder.mkdir(exist_ok=True)
    for old in folder.glob("callgrind.*"):
        old.unlink()
    command = ["valgrind", "-q", "--tool=callgrind", "--instr-atstart=no"]
    command += [f"--callgrind-out-file={folder}/callgrind", sys.executable, "-B", __file__]
    command += ["--count", path, "--only", only]
    done = subprocess.run(
        command, env={**os.environ, "FCL_FIBERS_SIMD": simd}, stdout=subprocess.PIPE, text=True
    )
    if done.returncode != 0:
        raise SystemExit(f"benchmarks/compare.py: callgrind of {path} has failed")
    rows = {}
    for number, line in enumerate(done.stdout.splitlines(), 1):
        _, answer, found, name = line.split("\t")
        text = Path(f"{folder}/callgrind.{number}").read_text(encoding="utf-8")
        instructions = int(re.search(r"^(?:summary|totals): (\d+)", text, re.MULTILINE)[1])
        rows[name] = (answer, int(found), instructions)
    return rows


def compare_instructions(paths, only):
    """Prints a table, and returns the names of rows whose answers differ."""
    different = []
    print(f"{'instructions':56} {'found':>8} {'old':>12} {'new':>12}  new/old")
    for simd in ("avx2", "sse4"):
        with ThreadPoolExecutor() as pool:
            old, new = pool.map(lambda path: counted(path, simd, only), paths)
        for name, (answer, found, instructions) in old.items():
            now = new[name][2]
            line = f"{name + ', ' + simd:56} {found:8} {instructions:12} {now:12}  "
            line += f"{now / instructions:.3f}"
            if new[name][:2] != (answer, found):
                different.append(name)
                line += "  THE ANSWERS DIFFER"
            print(line, flush=True)
    return different


def median_interval(values, chance):
    """The median, and the ends of its 95 % interval by bootstrap."""
    medians = sorted(statistics.median(chance.choices(values, k=len(values))) for _ in range(1000))
    return statistics.median(values), medians[25], medians[974]


def compare_times(paths, only, rounds):
    """Prints a table, and returns the names of rows whose answers differ."""
    libraries = [load(path) for path in paths]
    names = row_names(libraries[0], only)
    ratios = {row: [] for row in names}
    turns = {}
    times = {}
    different = []
    for number in range(rounds):
        # New scenes, because where memory lies makes a difference.
        for row, name in names.items():
            order = [0, 1] if number % 2 == 0 else [1, 0]
            answers = {i: libraries[i].row_open(row) for i in order}
            if answers[0] != answers[1] and name not in different:
                different.append(name)
            if row not in turns:
                turns[row] = math.ceil(SECONDS / max(libraries[0].row_time(1), 1e-6))
                libraries[1].row_time(1)
            seconds = [0, 0]
            for i in (*order, *reversed(order)) * 2:
                seconds[i] += libraries[i].row_time(turns[row])
            ratios[row].append(seconds[0] / seconds[1])
            times.setdefault(row, []).append(seconds[0] / 4 / turns[row])
    chance = random.Random(1)
    print(f"{'times':50} {'old, ms':>8}  old/new  95 % interval")
    for row, name in names.items():
        median, low, high = median_interval(ratios[row], chance)
        line = f"{name:50} {1000 * statistics.median(times[row]):8.3f}  {median:7.3f}  "
        line += f"{low:.3f} to {high:.3f}"
        print(line + ("  THE ANSWERS DIFFER" if name in different else ""))
    means = [
        math.exp(statistics.fmean(math.log(statistics.median(r)) for r in sample))
        for sample in [list(ratios.values())]
        + [[chance.choices(values, k=rounds) for values in ratios.values()] for _ in range(200)]
    ]
    spread = sorted(means[1:])
    print(f"{'geometric mean':59}  {means[0]:7.3f}  {spread[5]:.3f} to {spread[194]:.3f}")
    return different


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("trees", nargs="*", metavar="TREE", help="OLD and NEW")
    parser.add_argument("--instructions", action="store_true", help="count them, by callgrind")
    parser.add_argument("--times", action="store_true", help="take times, by turns")
    parser.add_argument("--only", default="", metavar="TEXT", help="rows with it in their names")
    parser.add_argument("--rounds", type=int, default=30, help="of times; 30 unless given")
    parser.add_argument("--count", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.count:
        count(options.count, options.only)
        return
    if len(options.trees) != 2:
        parser.error("give two folders, OLD and NEW")
    subprocess.run(
        [ROOT / ".ci" / "apt_install.sh", "valgrind", "cmake", "ninja-build", "g++", "libfcl-dev"]
        + ["libeigen3-dev", "libhwy-dev", "libtbb-dev"],
        check=True,
    )
    paths = [build(name, tree) for name, tree in zip(("old", "new"), options.trees)]
    different = []
    if options.instructions or not options.times:
        different += compare_instructions(paths, options.only)
    if options.times or not options.instructions:
        different += compare_times(paths, options.only, options.rounds)
    if different:
        raise SystemExit(f"The answers differ in: {'; '.join(sorted(set(different)))}")


if __name__ == "__main__":
    main()
