#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Compares the speed of two trees of the library, and what they find, call by call.

OLD and NEW are folders of this repository, such as worktrees. Each is called as its own
benchmarks/compare/ does, so names of calls may differ, but rows may not. Instructions are counted
under callgrind, with AVX2 and with SSE4, and do not depend on what else the machine does. Times are
taken of both libraries by turns in one process. They are given by the median of old/new, which is
above 1 if the new one is faster, and its 95 % interval. The comparison fails if a call finds
something else, or the same in another order.
"""

import argparse
import ctypes
import json
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
PACKAGES = "cmake ninja-build g++ valgrind libfcl-dev libeigen3-dev libhwy-dev libtbb-dev"
TURN = 0.004  # seconds at least


class Library:
    """The calls of rows.cpp over one tree."""

    def __init__(self, path, only):
        self.calls = ctypes.CDLL(path)
        self.calls.row_name.restype = ctypes.c_char_p
        self.calls.row_open.restype = ctypes.c_int64
        self.calls.row_time.restype = ctypes.c_double
        self.count = self.calls.row_count
        self.time = self.calls.row_time
        names = []
        while (name := self.calls.row_name(len(names))) is not None:
            names.append(name.decode())
        self.rows = {name: row for row, name in enumerate(names) if only in name}

    def open(self, name):
        """Makes the scene. Returns how much the query finds, and a hash of its order."""
        order = ctypes.c_uint64()
        return self.calls.row_open(self.rows[name], ctypes.byref(order)), order.value


def build(name, tree):
    """Returns the path of the library that has the calls over a tree."""
    folder = ROOT / "build" / "compare" / name
    tree = Path(tree).resolve()
    source = ["-S", tree / "benchmarks" / "compare", f"-DTREE={tree}"]
    for command in (["-G", "Ninja", "-B", folder, *source], ["--build", folder, "-t", "rows"]):
        subprocess.run(["cmake", *command], check=True, stdout=sys.stderr)
    return str(folder / "librows.so")


def count(path, only):
    """In a process under callgrind, which writes a file for each row."""
    library = Library(path, only)
    for name in library.rows:
        print(*library.open(name), name, sep="\t", flush=True)
        library.count()


def in_process(job, only, before=(), **variables):
    """What a process of this program prints that does the job."""
    command = [*before, sys.executable, "-B", __file__, "--only", only, "--job", *map(str, job)]
    env = {**os.environ, **variables}
    done = subprocess.run(command, env=env, check=True, stdout=subprocess.PIPE, encoding="utf-8")
    return done.stdout


def counted(path, simd, only):
    """What each row finds, and its instructions, by its name."""
    output = Path(path).parent / f"callgrind.{simd}"
    valgrind = ["valgrind", "-q", "--tool=callgrind", "--instr-atstart=no"]
    valgrind.append(f"--callgrind-out-file={output}")
    printed = in_process(["count", path], only, valgrind, FCL_FIBERS_SIMD=simd)
    rows = {}
    for number, line in enumerate(printed.splitlines(), 1):
        text = Path(f"{output}.{number}").read_text(encoding="utf-8")
        instructions = re.search(r"^(?:summary|totals): (\d+)", text, re.MULTILINE)[1]
        found, order, name = line.split("\t")
        rows[name] = (int(found), order), int(instructions)
    return rows


def compare_instructions(paths, only):
    """Prints a table. Returns the rows that find something else."""
    different = []
    ratios = {}
    print(f"{'instructions':55} {'found':>8} {'old':>12} {'new':>12}  new/old")
    for simd in ("avx2", "sse4"):
        with ThreadPoolExecutor() as pool:
            old, new = pool.map(lambda path: counted(path, simd, only), paths)
        for row, (answer, before) in old.items():
            name, after = f"{row}, {simd}", new[row][1]
            ratios[name] = after / before
            print(f"{name:55} {answer[0]:8} {before:12} {after:12}  {ratios[name]:.3f}", flush=True)
            if new[row][0] != answer:
                different.append(name)
    worst = max(ratios, key=ratios.get)
    print(f"At most {ratios[worst]:.3f} ({worst})")
    return different


def interval(values, estimate):
    """An estimate, and the ends of its 95 % interval by bootstrap, of a list of samples."""
    chance = random.Random(1)
    drawn = sorted(
        estimate([chance.choices(sample, k=len(sample)) for sample in values]) for _ in range(400)
    )
    return f"{estimate(values):7.3f}  {drawn[10]:.3f} to {drawn[389]:.3f}"


def mean_of_medians(samples):
    return statistics.geometric_mean(statistics.median(sample) for sample in samples)


def time_by_turns(number, paths, only):
    """In a process of its own, because it matters where code and memory lie."""
    order = 1 if number % 2 == 0 else -1
    libraries = [Library(path, only) for path in paths[::order]]
    rows = {}
    for name in libraries[0].rows:
        answers = [library.open(name) for library in libraries]
        turns = math.ceil(TURN / max(libraries[0].time(1), libraries[1].time(1), 1e-6))
        seconds = [0, 0]
        for i in (0, 1, 1, 0) * 2:
            seconds[i] += libraries[i].time(turns)
        old, new = seconds[::order]
        rows[name] = (old / 4 / turns, old / new, answers[0] == answers[1])
    print(json.dumps(rows))


def compare_times(paths, only, rounds):
    """Prints a table. Returns the rows that find something else."""
    results = [json.loads(in_process(["time", number, *paths], only)) for number in range(rounds)]
    rows = {name: list(zip(*(result[name] for result in results))) for name in results[0]}
    print(f"{'times':50} {'old, ms':>8}  old/new  95 % interval")
    for name, (seconds, ratios, _) in rows.items():
        least = 1000 * min(seconds)
        print(f"{name:50} {least:8.3f}  {interval([ratios], mean_of_medians)}")
    ratios = [ratios for _, ratios, _ in rows.values()]
    print(f"{'geometric mean':59}  {interval(ratios, mean_of_medians)}")
    return [name for name, (_, _, are_same) in rows.items() if not all(are_same)]


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("trees", nargs="*", metavar="TREE", help="OLD and NEW")
    parser.add_argument("--instructions", action="store_true", help="only count instructions")
    parser.add_argument("--times", action="store_true", help="only take times")
    parser.add_argument("--only", default="", metavar="TEXT", help="rows with it in their names")
    parser.add_argument("--rounds", type=int, default=15, help="of times; %(default)s unless given")
    parser.add_argument("--job", nargs="+", default=[""], help=argparse.SUPPRESS)
    options = parser.parse_args()
    job, *arguments = options.job
    if job == "count":
        return count(*arguments, options.only)
    if job == "time":
        return time_by_turns(int(arguments[0]), arguments[1:], options.only)
    if len(options.trees) != 2:
        parser.error("give two folders, OLD and NEW")
    for tree in options.trees:
        if not (Path(tree) / "src" / "CMakeLists.txt").exists():
            parser.error(f"{tree} is no folder of this repository")
    if options.rounds < 1:
        parser.error("--rounds has to be at least 1")
    subprocess.run([ROOT / ".ci" / "apt_install.sh", *PACKAGES.split()], check=True)
    paths = [build(*named) for named in zip(("old", "new"), options.trees)]
    if not Library(paths[0], options.only).rows:
        parser.error(f"no row has '{options.only}' in its name")
    different = []
    if options.instructions or not options.times:
        different += compare_instructions(paths, options.only)
    if options.times or not options.instructions:
        different += compare_times(paths, options.only, options.rounds)
    if different:
        raise SystemExit("THE TWO FIND DIFFERENT THINGS in these rows:\n" + "\n".join(different))


if __name__ == "__main__":
    main()
