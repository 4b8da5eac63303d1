# SPDX-License-Identifier: BSD-3-Clause
"""The table of FiberTree beside a plain loop that writes boxes."""

import pandas as pd

from ratios import ratio_of
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
        self.loops = pd.concat([part.runs("Arrays", n, "loop") for n in part.names("Arrays")])

    def get(self, name, key):
        return self.part.median("Arrays", name, key)

    def runs(self, name, key):
        return self.part.runs("Arrays", name, key)

    def times_the_loop(self, name, key):
        return ratio_of(self.runs(name, key), self.loops).text()

    def of_capsules(self, volumes):
        """A query for capsules, times one for volumes."""
        runs = (self.runs(f"{volumes}_capsules", "query"), self.runs(volumes, "query"))
        return ratio_of(*runs).text()

    def on_2_threads(self, volumes, key):
        """How many times as fast."""
        return ratio_of(self.runs(volumes, key), self.runs(f"{volumes}_2_threads", key)).text()

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

    rows.add("the loop, per segment", lambda s: ns(s, s.loops.median()))
    for volumes in VOLUMES:
        for key, what in PHASES.items():
            times = f"{volumes}: {what}, times the loop"
            rows.add(times, lambda s: s.times_the_loop(volumes, key))
        rows.add(f"{volumes}: query, per segment", lambda s: ns(s, s.get(volumes, "query")))
        times = f"{volumes}: query with kCapsules, times kVolumes"
        rows.add(times, lambda s: s.of_capsules(volumes))
        for key in ("build", "update", "query"):
            times = f"{volumes}: {key} on 2 threads, times as fast"
            rows.add(times, lambda s: s.on_2_threads(volumes, key))
        for name, what in ((volumes, ""), (f"{volumes}_capsules", ", kCapsules")):
            rows.add(f"{volumes}: bytes per segment{what}", lambda s: digits(s.bytes(name)))
    return Table("arrays", "FiberTree beside a plain loop", header_of(scenes), rows, READ)
