#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Processor time of distances beside that of pairs and contacts, of two trees of curled fibers.

    PYTHONPATH=build/release/python python3 benchmarks/python/distances.py

Prints the table of docs/trade.md: medians of 9 runs, in milliseconds.
"""

import statistics
import time

import numpy as np

import fcl_fibers

FIBERS, POINTS, RADIUS, NEAR = 1000, 101, 0.001, 0.01


def fibers(seed, away):
    """Helices along z, in a square of 2, moved along x: (FIBERS, POINTS, 3)."""
    rng = np.random.default_rng(seed)
    start, phase = rng.uniform(-1, 1, (FIBERS, 1, 2)), rng.uniform(0, 6, (FIBERS, 1))
    along = np.linspace(0, 2, POINTS)
    angle = 10 * along + phase
    points = np.empty((FIBERS, POINTS, 3))
    points[..., :2] = start + 0.05 * np.stack([np.cos(angle), np.sin(angle)], axis=2)
    points[..., 2] = along
    points[..., 0] += away
    return points


def tree_of(points):
    tree = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=1)
    tree.build(points, radii=RADIUS)
    return tree


def milliseconds(call):
    times = []
    for _ in range(9):
        begin = time.process_time_ns()
        call()
        times.append((time.process_time_ns() - begin) / 1e6)
    return statistics.median(times)


def main():
    tree = tree_of(fibers(1, 0))
    cloud = np.random.default_rng(3).uniform(-1, 1, (100000, 3)) + [0, 0, 1]
    print("| | distance | pairs | contacts | `closest()` | `Nearest`, near | `Nearest`, any |")
    print("|---|--:|--:|--:|--:|--:|--:|")
    for name, other in [
        ("one tree", None),
        ("two, which touch", tree_of(fibers(2, 0))),
        ("two, beside each other", tree_of(fibers(2, 2.25))),
        ("two, far apart", tree_of(fibers(2, 10))),
    ]:
        times = [
            milliseconds(call)
            for call in (
                lambda: tree.pairs(other),
                lambda: tree.contacts(other),
                lambda: tree.closest(other),
                lambda: tree.nearest(other, NEAR),
                lambda: tree.nearest(other),
            )
        ]
        print(f"| {name} | {tree.distance(other):.3g} |", *(f"{ms:.3g} |" for ms in times))
    near, hold = milliseconds(lambda: tree.nearest_to(cloud)), milliseconds(
        lambda: tree.holding(cloud)
    )
    print(f"\n100,000 points: nearest_to() {near:.3g} ms, holding() {hold:.3g} ms")


if __name__ == "__main__":
    main()
