# SPDX-License-Identifier: BSD-3-Clause
"""The table of FiberTree beside a plain loop that writes boxes."""

from statistics import median

from tables import Rows, Table, chosen, digits

VOLUMES = ("boxes", "spheres")
READ = (
    "The loop reads the points and writes a box of floats for each segment. Times are medians, "
    "on one thread unless the row says otherwise. The fibers move between two frames."
)

PHASES = {"build": "build", "update": "update", "unmoved": "update, nothing moved"}


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


def scenes_of(parts):
    return {name: Arrays(part) for name, part in chosen(parts, "arrays").items()}


def header_of(scenes):
    titles = (f"{name.split('-')[0]}, {s.segments:,.0f} segments" for name, s in scenes.items())
    return ["FiberTree", *titles]


def table(parts):
    scenes = scenes_of(parts)
    rows = Rows(scenes.values())

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
        for key in ("build", "update", "query"):
            times = f"{volumes}: {key} on 2 threads"
            rows.add(times, lambda s: digits(s.on_2_threads(volumes, key)) + "x as fast")
        for name, what in ((volumes, ""), (f"{volumes}_capsules", ", kCapsules")):
            rows.add(f"{volumes}: bytes per segment{what}", lambda s: digits(s.bytes(name)))
    return Table("arrays", "FiberTree beside a plain loop", header_of(scenes), rows, READ)
