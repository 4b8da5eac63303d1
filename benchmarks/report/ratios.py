# SPDX-License-Identifier: BSD-3-Clause
"""Who is best, and how many times as fast ours are."""

import re
from dataclasses import dataclass

import interval
import numpy as np
import pandas as pd
from tables import digits

BOXES, CAPSULES = "LayeredAABBTree/boxes", "LayeredAABBTree/capsules"
FCL = {
    "DynamicAABBTree": "FCL dynamic tree",
    "DynamicAABBTree_Array": "FCL dynamic tree, array",
    "SaP": "FCL SaP",
    "SSaP": "FCL SSaP",
    "IntervalTree": "FCL interval tree",
    "SpatialHashing": "FCL spatial hashing",
    "Naive": "FCL naive",
}
RUNS = 5  # at least, for an interval; what takes long and is no manager of FCL's may have one
ROUNDING = 0.01  # Bounds are rounded outward: so many more pairs are the same work.

# What the callback does with a pair, by how the contender's name ends; what a careful user
# writes is first.
TEST, COLLIDE = "_and_test", "_and_collide"
ON_2_THREADS = "; ours on 2 threads, FCL has none"


@dataclass(frozen=True)
class Row:
    """What is compared: the least median of a library's contenders, and ours."""

    title: str
    library: str  # FCL, or how the names of its contenders begin
    key: str = "frame"
    ours: str = BOXES
    boxes: str = ""  # tight, stock, or any
    then: str = ""  # TEST or COLLIDE on its pairs
    our_key: str = ""  # if it is another one
    threads: int = 1
    same_pairs: bool = False  # its boxes are ours, so that it has to report as many pairs


TIGHT = "Detection: FCL, tight boxes"
STOCK = "Detection: FCL, stock boxes"
UPDATE = "Update: FCL"
SET_UP = "Set-up: FCL, boxes written before"
SET_UP_WITH_BOXES = "Set-up: FCL, with its boxes"
COAL_TIGHT = "Detection: coal, tight boxes"
COAL_UPDATE = "Update: coal"
SET_UP_OF_COAL = "Set-up: coal, with its boxes"
TOUCHING_TEST = "Touching pairs: FCL, tight boxes, a closed-form capsule test"
TOUCHING_TIGHT = "Touching pairs: FCL, tight boxes, fcl::collide"
TOUCHING_STOCK = "Touching pairs: FCL, stock boxes, fcl::collide"
COAL_TEST = "Touching pairs: coal, a closed-form capsule test"
COAL_COLLIDE = "Touching pairs: coal, coal::collide"
EMBREE_TEST = "Touching pairs: Embree, a closed-form capsule test"
GRID_TEST = "Touching pairs: a uniform grid over midpoints, a closed-form capsule test"
EMBREE, EMBREE_2 = (f"Update + detection: Embree, {n}" for n in ("1 thread", "2 threads"))
GRID = "Update + detection: a uniform grid over midpoints"


def _rows():
    yield Row(TIGHT, "FCL", "detection", BOXES, "tight", same_pairs=True)
    yield Row(STOCK, "FCL", "detection", BOXES, "stock")
    yield Row(UPDATE, "FCL", "update")
    yield Row(SET_UP, "FCL", "set_up")
    yield Row(SET_UP_WITH_BOXES, "FCL", "set_up_with_boxes", our_key="set_up")
    for suffix, threads in (("", ""), (ON_2_THREADS, "_2_threads")):
        ours = CAPSULES + threads
        yield Row(TOUCHING_TEST + suffix, "FCL", "frame", ours, "tight", TEST)
        yield Row(TOUCHING_TIGHT + suffix, "FCL", "frame", ours, "tight", COLLIDE)
        yield Row(TOUCHING_STOCK + suffix, "FCL", "frame", ours, "stock", COLLIDE)
    yield Row(COAL_TIGHT, "coal", "detection", BOXES, "tight", same_pairs=True)
    yield Row(COAL_UPDATE, "coal", "update")
    yield Row(SET_UP_OF_COAL, "coal", "set_up")
    yield Row(COAL_TEST, "coal", "frame", CAPSULES, then=TEST)
    yield Row(COAL_COLLIDE, "coal", "frame", CAPSULES, then=COLLIDE)
    yield Row(EMBREE_TEST, "Embree", "frame", CAPSULES, then=TEST)
    yield Row(GRID_TEST, "Grid", "frame", CAPSULES, then=TEST)
    yield Row(EMBREE, "Embree")
    yield Row(EMBREE_2, "Embree", ours=BOXES + "_2_threads", threads=2)
    for key, what in (("update", "Update"), ("set_up", "Set-up")):
        yield Row(f"{what}: Embree, 1 thread", "Embree", key)
        yield Row(f"{what}: Embree, 2 threads", "Embree", key, BOXES + "_2_threads", threads=2)
    yield Row(GRID, "Grid")
    yield Row(GRID + ", 2 threads", "Grid", ours=BOXES + "_2_threads", threads=2)
    yield Row("Update + detection: Bullet", "Bullet")


ROWS = {row.title: row for row in _rows()}

READ = (
    "Ratios are medians, with their 95 % intervals, of ratios of runs that ended next to each "
    "other. One is 'as fast' "
    "where the interval lies within 0.9 to 1.1, and 'too noisy to tell' where its ends differ by a "
    "factor above 1.5. Fewer than five runs have no interval, and that of five is their range."
)
NOISY = 1.5  # An interval whose ends differ by more tells nothing.
AS_FAST, NEAR_ONE = (0.9, 1.1), (0.8, 1.25)


@dataclass
class Ratio:
    """A median, with the ends of its 95 % interval."""

    value: float
    low: float
    high: float
    against: str = ""  # the name of the other
    runs: int = 0  # if they are too few for an interval

    def text(self, with_boxes=False):
        """`with_boxes`: and which ones FCL had, tight or stock."""
        if self.runs:
            return f"about {digits(self.value, 2)}x, {self.runs} run" + "s" * (self.runs > 1)
        # Near the limits of the rule the reader sees enough digits.
        count = 3 if NEAR_ONE[0] < self.low and self.high < NEAR_ONE[1] else 2
        low, high = (digits(side, count) for side in (self.low, self.high))
        if self.high > NOISY * self.low:
            verdict = "too noisy to tell"
        elif AS_FAST[0] <= self.low and self.high <= AS_FAST[1]:
            verdict = "as fast"
        else:
            verdict = f"{digits(self.value, count)}x"
        boxes = f", {boxes_of(self.against)}" if with_boxes else ""
        return f"{verdict} ({low} to {high}){boxes}"


def ratio_of(theirs, ours, against=""):
    """Of two series of runs: the median of their ratios, each of two of one process."""
    theirs, ours = map(interval.by_process, (theirs, ours))
    ratios = {one: ratios_of(theirs[one], ours[one]) for one in sorted(theirs.keys() & ours.keys())}
    return median_of(pd.concat(ratios), against)


def ratios_of(theirs, ours):
    """Of two series of one process: of each run of the shorter one and that of the other which
    ended next to it. A machine that is shared is slow for seconds at a time, for both."""
    fewer, more = sorted((theirs, ours), key=len)
    nearest = np.abs(np.subtract.outer(fewer.index, more.index)).argmin(axis=1)
    ratios = fewer / more.to_numpy()[nearest]
    return ratios if fewer is theirs else 1 / ratios


def median_of(ratios, against=""):
    """Of ratios of times that were taken next to each other."""
    return Ratio(ratios.median(), *interval.of_median(ratios), against, few(ratios))


def few(runs):
    """Their number, if it is too small for an interval."""
    return len(runs) if len(runs) < RUNS else 0


def boxes_of(name):
    """`tight`, `stock` or both, or nothing of a library that has boxes of its own."""
    return " or ".join(dict.fromkeys(re.findall(r"(?<![a-z])(?:tight|stock)(?![a-z])", name)))


def is_fcls(name):
    return name.split("/")[0] in FCL


def after_query(name):
    """TEST, COLLIDE, or nothing."""
    return next((then for then in (TEST, COLLIDE) if name.endswith(then)), "")


def set_up_key(name):
    """Of its whole set-up: FCL's managers read boxes that were written before."""
    return "set_up_with_boxes" if is_fcls(name) else "set_up"


class Scene:
    """The frames of one scene."""

    def __init__(self, name, part):
        self.name, self.part = name, part
        self.contenders, self._ratios = part.names("Frames"), {}
        first = part.names("Checked")[0]
        self.segments = part.median("Checked", first, "segments")
        self.fibers = part.median("Checked", first, "fibers")

    def processes(self):
        return len(self.part.processes())

    def title(self):
        each = self.segments / self.fibers
        size = f" x {each:,.0f}" if each == int(each) else f", {self.segments:,.0f} segments"
        return f"{self.part.title(self.name.split('-2000')[0])} {self.fibers:,.0f}{size}"

    def median(self, name, key):
        return self.part.median("Frames", name, key)

    def checked(self, name, key):
        return self.part.median("Checked", name, key)

    def of(self, library, boxes="", then="", threads=1):
        """A library's contenders with such boxes, and with TEST or COLLIDE on their pairs."""

        def is_its(name):
            return is_fcls(name) if library == "FCL" else name.startswith(library)

        return [
            name
            for name in self.contenders
            if is_its(name)
            and after_query(name) == then
            and name.endswith("_2_threads") == (threads == 2)
            and (not boxes or boxes_of(name) == boxes)
        ]

    def best(self, names, key):
        """The one rule for all rows: the least median of exactly what the row measures. A tree that
        was fast in set-up alone, when all were tried, has only that."""
        names = [name for name in names if self.part.knows("Frames", name, key)]
        if not names:
            raise KeyError(f"{self.part.file}: nobody to compare {key} with")
        return min(names, key=lambda name: self.median(name, key))

    def runs(self, name, key):
        runs = self.part.runs("Frames", name, key)
        if len(runs) < RUNS and (len(runs) > 1 or is_fcls(name) or name == BOXES):
            raise ValueError(f"{self.part.file}: {name} has {len(runs)} runs, not {RUNS}")
        return runs

    def has(self, library):
        """False where it is not installed."""
        return library not in self.part.context["left_out"]

    def ratio(self, title):
        """Of the row of that title; None where the library was not measured."""
        if title not in self._ratios:
            self._ratios[title] = self._ratio(ROWS[title])
        return self._ratios[title]

    def _ratio(self, row):
        """Each process has a best of its own."""
        found = [Scene(self.name, part).best_of(row) for part in self.part.processes()]
        if None in found:
            return None
        against = " or ".join(dict.fromkeys(name for name, _ in found))
        ours = self.runs(row.ours, row.our_key or row.key)
        return ratio_of(pd.concat([runs for _, runs in found]), ours, against)

    def best_of(self, row):
        """Whom the row compares with, and the runs; None if there is nobody. Of one process."""
        names = self.of(row.library, row.boxes, row.then, row.threads)
        if not names and row.library != "FCL":
            return None
        best = self.best(names, row.key)
        if row.same_pairs:
            pairs, theirs = self.median(row.ours, "pairs"), self.median(best, "pairs")
            if abs(pairs - theirs) > ROUNDING * theirs:
                raise ValueError(f"{self.part.file}: {pairs} pairs, {best} {theirs}")
        return best, self.runs(best, row.key)

    def sampled(self, row):
        """Pairs that the library's own test was called on in a run and pairs that there are, of the
        best."""
        name = self.best(self.of(row.library, row.boxes, COLLIDE), "frame")
        return self.median(name, "sampled"), self.median(name, "of")

    def bytes(self, name):
        return self.checked(name, "bytes_after_frames") / self.segments

    def of_fcls_bytes(self):
        return self.bytes(BOXES) / self.bytes(self.best(self.of("FCL"), "frame"))

    def times_the_floor(self):
        return self.median(BOXES, "update") / self.part.median("Floor", "read", "seconds")
