#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Times of the Python package: of a step beside other ways, of the same step in C++, of its import.

A step is an update after a motion and a query of all pairs that touch, adjacent segments left out.
benchmarks/run.sh --python builds what this needs and calls it. Results have the form of Google
Benchmark's, so that report/results.py reads them; each repetition is one run:

    Checked/CONTENDER   once, after its answers in both frames have been checked; "found" counts
                        them, and the label is ">10 s" if it is too slow to be timed
    Steps/CONTENDER     a step
    Overhead/WHO/QUERY  a step by WHO, which is python or cpp, with threads
    Import/MODULE       a whole process that imports it
"""

import argparse
import contextlib
import gc
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from importlib import metadata
from pathlib import Path
from typing import NamedTuple

import numpy as np
from contenders import OURS, PEERS, Ours, Truth

ROUNDS = 9  # of contenders that take turns; of a round that takes more than LONG seconds fewer
LONG, LONG_ROUNDS = 5.0, 5
SLOW = 10.0  # seconds of a step that is checked, but not timed
TURN = 0.3  # seconds that a fast contender is repeated in one turn, at most 5 times
OVERHEAD = (25, 4)  # turns, and steps in each
IMPORTS = 21


class Scene(NamedTuple):
    offsets: np.ndarray
    radius: float
    frames: np.ndarray  # (2, points, 3): they take turns

    @property
    def segments(self):
        return int(np.sum(np.maximum(np.diff(self.offsets) - 1, 0)))


def read_scene(path):
    """Of the file that fcl_fibers_step_in_cpp writes; its head tells the form."""
    with open(path, "rb") as file:
        fibers, points = np.fromfile(file, np.int64, 2)
        (radius,) = np.fromfile(file, np.float64, 1)
        offsets = np.fromfile(file, np.int64, fibers + 1)
        frames = np.fromfile(file, np.float64, 6 * points).reshape(2, points, 3)
    return Scene(offsets, float(radius), frames)


def write_scene(scene, path):
    """Such a file."""
    with open(path, "wb") as file:
        np.array([len(scene.offsets) - 1, scene.offsets[-1]], np.int64).tofile(file)
        np.array([scene.radius]).tofile(file)
        scene.offsets.tofile(file)
        scene.frames.tofile(file)


def bundles(streamlines, step=1.0, seed=1):
    """Like a tractogram: 10 bundles of smooth streamlines of 100 steps, half across the others.

    About 8 streamlines, tubes of 0.1 mm, pass each square millimetre and wander in their bundle.
    """
    random, streamlines = np.random.RandomState(seed), int(streamlines)
    along = step * (np.arange(101) - 50.0)
    radius = 0.2 * np.sqrt(streamlines / 10)
    frames = np.empty((2, 10, streamlines // 10, len(along), 3))
    for bundle in range(10):
        way, side = bundle % 2, 1 - bundle % 2
        angle = 2 * np.pi * random.rand(streamlines // 10, 1)
        distance = radius * np.sqrt(random.rand(streamlines // 10, 1))
        wander, phase = 0.2 * random.randn(streamlines // 10, 2, 1), 6 * random.rand(2)
        for frame in range(2):
            x, y = (wander[:, k] * np.sin(along / 20 + phase[k] + 0.05 * frame) for k in (0, 1))
            points = frames[frame, bundle]
            points[..., way] = along
            points[..., side] = distance * np.cos(angle) + x + 1.5 * radius * (bundle // 2 - 2)
            points[..., 2] = distance * np.sin(angle) + y + way * radius + along**2 / 500
    offsets = np.arange(streamlines + 1, dtype=np.int64) * len(along)
    return Scene(offsets, 0.05, frames.reshape(2, -1, 3))


def rods(count, seed=1):
    """A bundle of straight rods of 50 elements, each as long as two of its diameters.

    They are nearly parallel and pressed together, so that most neighbours touch along their way.
    """
    count = int(count)
    edge = int(np.ceil(np.sqrt(count)))
    beside = 1.95 * np.stack(np.divmod(np.arange(count), edge), axis=1)
    along = 4 * np.linspace(-25, 25, 51)[:, np.newaxis]
    frames = np.empty((2, count, 51, 3))
    for frame in range(2):
        tilt = (0.004 + 0.0005 * frame) * np.random.RandomState(seed).randn(count, 1, 2)
        frames[frame, ..., 0] = along[:, 0]
        frames[frame, ..., 1:] = beside[:, np.newaxis] + along * tilt
    return Scene(np.arange(count + 1, dtype=np.int64) * 51, 1.0, frames.reshape(2, -1, 3))


class Results:
    def __init__(self, options):
        self.options, self.runs = options, []

    def add(self, kind, name, seconds, label="", **counters):
        numbers = {key: float(value) for key, value in counters.items()}
        head = {"run_type": "iteration", "run_name": f"{kind}/{name}", "label": label}
        self.runs.append({**head, "real_time": float(seconds), "time_unit": "s", **numbers})

    def write(self):
        known = subprocess.run(
            [self.options.program, "compiler"], check=True, capture_output=True, text=True
        )
        compiler, build_type = known.stdout.split("\n")[:2]
        packages = dict.fromkeys(["NumPy", "Numba", *(package for _, package, _ in PEERS.values())])
        found = {name: version_of(name) for name in packages}
        versions = [f"{name} {version}" for name, version in found.items() if version]
        versions = [f"Python {platform.python_version()}", *versions]
        # The folders of the program and of results mean nothing to others.
        words = [w for w in sys.argv[1:] if not w.startswith(("--program", "--benchmark_out"))]
        context = {
            "machine": f"{processor()}, {os.cpu_count()} cores",
            "compiler": ", ".join([compiler, *versions]),
            "build_type": build_type,
            "commit": os.environ.get("FCL_FIBERS_COMMIT", "unknown"),
            "code": os.environ.get("FCL_FIBERS_CODE", "unknown"),
            "command": " ".join(["steps.py", *words]),
            "left_out": ", ".join(name for name, version in found.items() if not version),
            "measure": self.options.measure,
            "scene": self.options.scene,
        }
        text = json.dumps({"context": context, "benchmarks": self.runs}, indent=1)
        self.options.benchmark_out.write_text(text + "\n", encoding="utf-8")


def version_of(package):
    """Nothing where it is not installed."""
    with contextlib.suppress(metadata.PackageNotFoundError):
        return metadata.version(package)


def processor():
    found = "unknown processor"
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            found = line.partition(":")[2].strip()
    return found


def timed(step, points):
    start = time.perf_counter()
    found = step(points)
    return time.perf_counter() - start, found


def measure_steps(results, scene):
    truths = [Truth(scene, k) for k in (0, 1)]
    known = {name: (make, None) for name, make in OURS.items()}
    for name, (make, package, largest) in PEERS.items():
        if version_of(package):
            known[name] = make, largest
    turns = {}
    for name, (make, largest) in known.items():
        counters = {"segments": scene.segments}
        if largest and scene.segments > largest:
            results.add("Checked", name, SLOW, label=f">{SLOW:.0f} s", **counters)
            continue
        contender = make(scene)
        frames = [contender.prepare(k) for k in (0, 1)]
        # This also compiles functions and takes memory, which is not to be timed.
        for k in (1, 0):
            seconds, found = timed(contender.step, frames[k])
            try:
                counters["found"] = contender.check(found, truths[k])
            except RuntimeError as error:
                raise RuntimeError(f"{name}, frame {k}: {error}") from error
        label = f">{SLOW:.0f} s" if seconds > SLOW else ""
        results.add("Checked", name, seconds, label=label, **counters)
        if not label:
            turns[name] = contender.step, frames, seconds, counters

    # Python's garbage collector would walk what all packages have made, which a program with one of
    # them has not.
    gc.collect()
    gc.freeze()
    rounds = LONG_ROUNDS if sum(turn[2] for turn in turns.values()) > LONG else ROUNDS
    for turn in range(rounds):
        for name, (step, frames, took, counters) in turns.items():
            # The first step after the others is slower, as the processor's caches hold their data.
            # A simulation would not have it otherwise, so that it counts.
            for repeat in range(max(1, min(5, int(TURN / took)))):
                seconds, _ = timed(step, frames[(turn + repeat) % 2])
                results.add("Steps", name, seconds, turn=turn, **counters)


def measure_overhead(results, scene, path):
    """Python and C++ take turns, each for a few steps, with the same library."""
    turns, steps = OVERHEAD
    command = [results.options.program, "step", path]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:

        def in_cpp(query, threads):
            process.stdin.write(f"{query} {threads} {steps}\n")
            process.stdin.flush()
            lines = [process.stdout.readline().split() for _ in range(steps)]
            return [(float(seconds), int(found)) for seconds, found in lines]

        for query in ("pairs", "contacts"):
            for threads in (1, 2):
                ours = Ours(scene, query, threads)
                found = None

                def in_python():
                    nonlocal found
                    for step in range(steps):
                        start = time.perf_counter()
                        found = ours.step(scene.frames[(step + 1) % 2])
                        yield time.perf_counter() - start, len(found)

                ways = {
                    "python": in_python,
                    "cpp": lambda: in_cpp(query, threads),
                    "cpp_new": lambda: in_cpp(f"new_{query}", threads),
                }
                for turn in range(-1, turns):
                    counts = set()
                    for who, way in ways.items():
                        for seconds, count in way():
                            counts.add(count)
                            if turn >= 0:
                                name = f"{who}/{query}/{threads}"
                                counters = {
                                    "pairs": count,
                                    "segments": scene.segments,
                                    "turn": turn,
                                }
                                results.add("Overhead", name, seconds, **counters)
                    if len(counts) > 2:  # one of each frame
                        raise RuntimeError(f"Python and C++ differ: {sorted(counts)} pairs")
        process.stdin.close()


def measure_import(results):
    for turn in range(-1, IMPORTS):
        for module in ("numpy", "fcl_fibers"):
            start = time.perf_counter()
            subprocess.run([sys.executable, "-c", f"import {module}"], check=True)
            if turn >= 0:  # the first one reads files from the disk
                results.add("Import", module, time.perf_counter() - start)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--measure", choices=("steps", "overhead", "import"), required=True)
    parser.add_argument(
        "--scene", default="", help="bundles:N or bundles:N,STEP in mm, rods:N, or as the C++ knows"
    )
    parser.add_argument("--program", help="fcl_fibers_step_in_cpp", required=True)
    parser.add_argument("--benchmark_out", type=Path, metavar="FILE.json", required=True)
    options = parser.parse_args()
    results = Results(options)
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "scene")
        made, _, numbers = options.scene.partition(":")
        if made in ("bundles", "rods"):
            scene = {"bundles": bundles, "rods": rods}[made](*map(float, numbers.split(",")))
            write_scene(scene, path)
        elif options.scene:
            subprocess.run([options.program, "write", options.scene, path], check=True)
            scene = read_scene(path)
        if options.measure == "steps":
            measure_steps(results, scene)
        elif options.measure == "overhead":
            measure_overhead(results, scene, path)
        else:
            measure_import(results)
    results.write()


if __name__ == "__main__":
    main()
