# SPDX-License-Identifier: BSD-3-Clause
"""The table of FiberTree beside a plain loop that writes boxes."""

from statistics import median

from tables import Rows, Table, digits, target

SCENES = ("helix", "helix-2000", "cap")
VOLUMES = ("boxes", "spheres")
READ = (
    "The loop reads the points and writes a box of floats for each segment. Times are medians, "
    "on one thread unless the row says otherwise. The fibers move between two frames."
)

# What is to be reached, by scene.
MOST_TIMES_THE_LOOP = {"build": (28, 28, 45), "update": (6, 8, 10), "unmoved": (3, 3.5, 4)}
MOST_OF_CAPSULES = 1.3
LEAST_ON_2_THREADS = {"build": 1.6, "update": 1.6, "query": 1.8}
LARGE = 1e6  # segments of the scenes that are to be as fast as that on 2 threads
MOST_BYTES = {"boxes": 43, "boxes_capsules": 75}

PHASES = {"build": "build", "update": "update", "unmoved": "update, nothing moved"}


def parts_of(parts):
    """By scene, those that were measured."""
    return {name: parts[f"arrays_{name}"] for name in SCENES if f"arrays_{name}" in parts}


class Arrays:
    """What was measured of one scene."""

    def __init__(self, part):
        self.part = part
        self.segments = self.get("boxes", "segments")
        self.loop = median(self.get(name, "loop") for name in part.names("Arrays"))

    def get(self, name, key):
        return self.part.median("Arrays", name, key)

    def times_the_loop(self, name, key):
        return self.get(name, key) / self.loop

    def of_capsules(self, volumes):
        """A query for capsules, times one for volumes."""
        return self.get(f"{volumes}_capsules", "query") / self.get(volumes, "query")

    def on_2_threads(self, volumes, key):
        return self.get(volumes, key) / self.get(f"{volumes}_2_threads", key)

    def bytes(self, name):
        return self.get(name, "bytes") / self.segments


def rows_of(parts):
    return Rows(Arrays(part) for part in parts_of(parts).values())


def table(parts):
    rows = rows_of(parts)

    def ns(scene, seconds):
        return f"{digits(1e9 * seconds / scene.segments)} ns"

    rows.add("the loop, per segment", lambda s: ns(s, s.loop))
    for volumes in VOLUMES:
        for key, what in PHASES.items():
            times = f"{volumes}: {what}"
            rows.add(times, lambda s: digits(s.times_the_loop(volumes, key)) + "x the loop")
        rows.add(f"{volumes}: query, per segment", lambda s: ns(s, s.get(volumes, "query")))
        times = f"{volumes}: query with kCapsules"
        rows.add(times, lambda s: digits(s.of_capsules(volumes)) + "x kVolumes")
        for key in LEAST_ON_2_THREADS:
            times = f"{volumes}: {key} on 2 threads"
            rows.add(times, lambda s: digits(s.on_2_threads(volumes, key)) + "x as fast")
        for name, what in ((volumes, ""), (f"{volumes}_capsules", ", kCapsules")):
            rows.add(f"{volumes}: bytes per segment{what}", lambda s: digits(s.bytes(name)))
    sizes = zip(parts_of(parts), rows.columns)
    titles = (f"{name.split('-')[0]}, {scene.segments:,.0f} segments" for name, scene in sizes)
    return Table("arrays", "FiberTree beside a plain loop", ["FiberTree", *titles], rows, READ)


def targets(parts):
    rows = rows_of(parts)
    for key, goals in MOST_TIMES_THE_LOOP.items():
        goal = dict(zip(rows.columns, (goals[SCENES.index(name)] for name in parts_of(parts))))
        what = f"{PHASES[key]}, times the loop"
        rows.add(what, lambda s: target(s.times_the_loop("boxes", key), goal[s]))
    what = "query for capsules, times volumes"
    rows.add(what, lambda s: target(s.of_capsules("boxes"), MOST_OF_CAPSULES))
    for key, least in LEAST_ON_2_THREADS.items():

        def on_2_threads(s):
            goal = least if s.segments > LARGE else None
            return target(s.on_2_threads("boxes", key), goal, least=True)

        rows.add(f"{key} on 2 threads", on_2_threads)
    for name, most in MOST_BYTES.items():
        rows.add(f"bytes a segment, {name}", lambda s: target(s.bytes(name), most))
    return Table("targets of arrays", "Targets of arrays", table(parts).header, rows)
