# SPDX-License-Identifier: BSD-3-Clause
"""The table of FiberTree beside a plain loop that writes boxes."""

from statistics import median

from tables import Table, digits

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


def table(parts):
    scenes = {name: Arrays(part) for name, part in parts_of(parts).items()}
    rows = []

    def add(what, value):
        rows.append([what, *(value(scene) for scene in scenes.values())])

    def ns(scene, seconds):
        return f"{digits(1e9 * seconds / scene.segments)} ns"

    add("the loop, per segment", lambda s: ns(s, s.loop))
    for volumes in VOLUMES:
        for key, what in PHASES.items():
            add(
                f"{volumes}: {what}",
                lambda s: digits(s.times_the_loop(volumes, key)) + "x the loop",
            )
        add(f"{volumes}: query, per segment", lambda s: ns(s, s.get(volumes, "query")))
        add(
            f"{volumes}: query with kCapsules",
            lambda s: digits(s.of_capsules(volumes)) + "x kVolumes",
        )
        for key in LEAST_ON_2_THREADS:
            add(
                f"{volumes}: {key} on 2 threads",
                lambda s: digits(s.on_2_threads(volumes, key)) + "x as fast",
            )
        for name, what in ((volumes, ""), (f"{volumes}_capsules", ", kCapsules")):
            add(f"{volumes}: bytes per segment{what}", lambda s: digits(s.bytes(name)))
    titles = (
        f"{name.split('-')[0]}, {scene.segments:,.0f} segments" for name, scene in scenes.items()
    )
    header = ["FiberTree", *titles]
    return Table("arrays", "FiberTree beside a plain loop", header, rows, READ)


def targets(parts):
    scenes = {name: Arrays(part) for name, part in parts_of(parts).items()}
    rows = []

    def at_most(what, value, goals):
        cells = []
        for name, scene in scenes.items():
            found, most = value(scene), goals[SCENES.index(name)]
            cells.append(f"{digits(found)} {'met' if found <= most else 'MISSED'} (at most {most})")
        rows.append([what, *cells])

    def on_2_threads(key, least):
        cells = []
        for scene in scenes.values():
            found = scene.on_2_threads("boxes", key)
            verdict = f"{digits(found)} {'met' if found >= least else 'MISSED'} (at least {least})"
            cells.append(verdict if scene.segments > LARGE else "-")
        rows.append([f"{key} on 2 threads", *cells])

    for key, goals in MOST_TIMES_THE_LOOP.items():
        at_most(f"{PHASES[key]}, times the loop", lambda s: s.times_the_loop("boxes", key), goals)
    goals = 3 * [MOST_OF_CAPSULES]
    at_most("query for capsules, times volumes", lambda s: s.of_capsules("boxes"), goals)
    for key, goal in LEAST_ON_2_THREADS.items():
        on_2_threads(key, goal)
    for name, goal in MOST_BYTES.items():
        at_most(f"bytes a segment, {name}", lambda s: s.bytes(name), 3 * [goal])
    return Table("targets of arrays", "Targets of arrays", table(parts).header, rows)
