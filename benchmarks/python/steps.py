#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Times of the Python package: of a step beside other ways, of the same step in C++, of its import.

A step is an update after a motion and a query of all pairs that touch, adjacent segments left out.
benchmarks/run.sh --python builds what this needs and calls it. Results have the form of Google
Benchmark's, so that report/results.py reads them; each repetition is one run:

    Checked/CONTENDER   once, after all contenders have found the same pairs in both frames
    Steps/CONTENDER     a step
    Overhead/WHO/QUERY  a step by WHO, which is python or cpp, with threads
    Import/MODULE       a whole process that imports it
"""

import argparse
import contextlib
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

import fcl_fibers

ROUNDS = 7  # of contenders that take turns; at least 3 if they are slow
LONG = 40.0  # seconds of a round, from which on there are only 3
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


def bundles(streamlines, seed=1):
    """Like a tractogram: 10 bundles of smooth streamlines of 100 mm, half across the others.

    About 8 streamlines, tubes of 0.1 mm, pass each square millimetre and wander in their bundle.
    """
    random = np.random.RandomState(seed)
    along = np.arange(101) - 50.0
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


class Ours:
    def __init__(self, scene, query, threads):
        self.tree = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=1, threads=threads)
        self.tree.build(scene.frames[0], scene.offsets, scene.radius)
        self.query = getattr(self.tree, query)
        self.offsets = scene.offsets

    def step(self, points):
        self.tree.update(points)
        return self.query()

    def pairs(self, found):
        """Of whatever the query has returned."""
        if found.dtype.names is None:
            return found
        return np.stack([found["a"], found["b"]], axis=1)


class Results:
    def __init__(self, options):
        self.options, self.runs = options, []

    def add(self, kind, name, seconds, **counters):
        numbers = {key: float(value) for key, value in counters.items()}
        head = {"run_type": "iteration", "run_name": f"{kind}/{name}"}
        self.runs.append({**head, "real_time": float(seconds), "time_unit": "s", **numbers})

    def write(self):
        known = subprocess.run(
            [self.options.program, "compiler"], check=True, capture_output=True, text=True
        )
        compiler, build_type = known.stdout.split("\n")[:2]
        versions = [f"Python {platform.python_version()}"]
        for name in ("NumPy", "SciPy", "Numba"):
            with contextlib.suppress(metadata.PackageNotFoundError):
                versions.append(f"{name} {metadata.version(name)}")
        # The folders of the program and of results mean nothing to others.
        words = [w for w in sys.argv[1:] if not w.startswith(("--program", "--benchmark_out"))]
        context = {
            "machine": f"{processor()}, {os.cpu_count()} cores",
            "compiler": ", ".join([compiler, *versions]),
            "build_type": build_type,
            "commit": os.environ.get("FCL_FIBERS_COMMIT", "unknown"),
            "code": os.environ.get("FCL_FIBERS_CODE", "unknown"),
            "command": " ".join(["steps.py", *words]),
            "left_out": "",
            "measure": self.options.measure,
            "scene": self.options.scene,
        }
        text = json.dumps({"context": context, "benchmarks": self.runs}, indent=1)
        self.options.benchmark_out.write_text(text + "\n", encoding="utf-8")


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
    from rivals import AllElements, MidpointTree

    contenders = {
        f"{query}, {threads} thread{'s' if threads > 1 else ''}": Ours(scene, query, threads)
        for query in ("pairs", "contacts")
        for threads in (1, 2)
    }
    contenders["all elements"] = AllElements(scene.offsets, scene.radius)
    contenders["midpoint tree"] = MidpointTree(scene.offsets, scene.radius)

    # This also compiles Numba's functions and takes memory, which is not to be timed.
    expected, took = {}, {}
    for name, contender in contenders.items():
        of = getattr(contender, "pairs", lambda found: found)
        for frame in (1, 0):
            seconds, found = timed(contender.step, scene.frames[frame])
            pairs = of(found).astype(np.int64)
            keys = np.sort(pairs.min(axis=1) * len(scene.frames[0]) + pairs.max(axis=1))
            if not np.array_equal(keys, expected.setdefault(frame, keys)):
                raise RuntimeError(f"{name}: {len(keys)} pairs, not {len(expected[frame])}")
        took[name] = seconds
        counters = {"pairs": len(keys), "segments": scene.segments}
        results.add("Checked", name, seconds, **counters)

    times = {name: max(1, min(5, int(TURN / seconds))) for name, seconds in took.items()}
    rounds = 3 if sum(took.values()) > LONG else ROUNDS
    for turn in range(rounds):
        for name, contender in contenders.items():
            # The first step after the others is slower, as the processor's caches hold their data.
            # A simulation would not have it otherwise, so that it counts.
            for step in range(times[name]):
                seconds, _ = timed(contender.step, scene.frames[(turn + step) % 2])
                results.add("Steps", name, seconds, **counters)


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
    parser.add_argument("--scene", default="", help="bundles:N streamlines, or as the C++ knows")
    parser.add_argument("--program", help="fcl_fibers_step_in_cpp", required=True)
    parser.add_argument("--benchmark_out", type=Path, metavar="FILE.json", required=True)
    options = parser.parse_args()
    results = Results(options)
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "scene")
        if options.scene.startswith("bundles:"):
            scene = bundles(int(options.scene.partition(":")[2]))
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
