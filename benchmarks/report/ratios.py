# SPDX-License-Identifier: BSD-3-Clause
"""Who is best, and how many times as fast ours are."""

from dataclasses import dataclass

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
ROUNDING = 0.01  # Bounds are rounded outward: so many more pairs are the same work.

# Rows of Scene.ratios().
TIGHT = "Detection: FCL, tight boxes"
STOCK = "Detection: FCL, stock boxes"
UPDATE = "Update: FCL"
SET_UP = "Set-up: FCL, boxes written before"
SET_UP_WITH_BOXES = "Set-up: FCL, with its boxes"
TOUCHING_TEST = "Touching pairs: FCL, tight boxes, a closed-form capsule test"
TOUCHING_TIGHT = "Touching pairs: FCL, tight boxes, fcl::collide"
TOUCHING_STOCK = "Touching pairs: FCL, stock boxes, fcl::collide"
# What the callback of FCL's tree does with a pair, by how the contender's name ends; what a careful
# user writes is first.
TEST, COLLIDE = "_and_test", "_and_collide"
TOUCHING = {
    TOUCHING_TEST: ("tight", TEST),
    TOUCHING_TIGHT: ("tight", COLLIDE),
    TOUCHING_STOCK: ("stock", COLLIDE),
}
EMBREE = {"frame": "Update + detection", "update": "Update", "set_up": "Set-up"}
ON_2_THREADS = "; ours on 2 threads"

SCENES = ("helix", "helix-2000", "cap", "paper-dynamic")


@dataclass
class Ratio:
    """Of medians; and the least and the greatest that single runs allow."""

    value: float
    low: float
    high: float
    against: str  # the name of the other

    def text(self, with_boxes=False):
        """`with_boxes`: and which ones FCL had, tight or stock."""
        spread = f"({digits(self.low, 2)} to {digits(self.high, 2)})"
        if with_boxes:
            spread += ", " + self.against.split("/")[1].split("_")[0]
        # Of the range as it is shown, so that the reader sees the rule.
        low, high = (float(digits(side, 2).replace(",", "")) for side in (self.low, self.high))
        as_fast = low <= 1 <= high
        return f"as fast {spread}" if as_fast else f"{digits(self.value, 2)}x {spread}"


def ratio_of(theirs, ours, against):
    low, high = theirs.min() / ours.max(), theirs.max() / ours.min()
    return Ratio(theirs.median() / ours.median(), low, high, against)


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
        self.contenders = part.names("Frames")
        first = part.names("Checked")[0]
        self.segments = part.median("Checked", first, "segments")
        self.fibers = part.median("Checked", first, "fibers")

    def title(self):
        each = self.segments / self.fibers
        size = f" x {each:,.0f}" if each == int(each) else f", {self.segments:,.0f} segments"
        return f"{self.part.title(self.name.split('-2000')[0])} {self.fibers:,.0f}{size}"

    def median(self, name, key):
        return self.part.median("Frames", name, key)

    def checked(self, name, key):
        return self.part.median("Checked", name, key)

    def fcl(self, boxes="", then=""):
        """FCL's contenders with such boxes, tight or stock; any if none are named. `then`: TEST or
        COLLIDE on their pairs."""
        names = [name for name in self.contenders if is_fcls(name)]
        names = [name for name in names if after_query(name) == then]
        return [name for name in names if f"/{boxes}" in name]

    def embree(self, on="1 thread"):
        names = [name for name in self.contenders if name.startswith("Embree/")]
        return [name for name in names if name.endswith("_2_threads") == (on == "2 threads")]

    def best(self, names, key):
        """The one rule for all rows: the least median of exactly what the row measures. A tree that
        was fast in set-up alone, when all were tried, has only that."""
        names = [name for name in names if self.part.knows("Frames", name, key)]
        if not names:
            raise KeyError(f"{self.part.file}: nobody to compare {key} with")
        return min(names, key=lambda name: self.median(name, key))

    def runs(self, name, key):
        runs = self.part.runs("Frames", name, key)
        least = 3 if self.segments >= 1_000_000 else 5
        if len(runs) < least:
            raise ValueError(f"{self.part.file}: {name} has {len(runs)} runs, not {least}")
        return runs

    def ratio(self, names, key, ours, our_key=""):
        against = self.best(names, key)
        return ratio_of(self.runs(against, key), self.runs(ours, our_key or key), against)

    def has_embree(self):
        return bool(self.embree()) or "Embree" not in self.part.context["left_out"]

    def detection_on_tight_boxes(self):
        """Boxes are the same only if there are as many pairs."""
        ratio = self.ratio(self.fcl("tight"), "detection", BOXES)
        ours, theirs = self.median(BOXES, "pairs"), self.median(ratio.against, "pairs")
        if abs(ours - theirs) > ROUNDING * theirs:
            raise ValueError(f"{self.part.file}: {ours} pairs, {ratio.against} {theirs}")
        return ratio

    def ratios(self):
        """By row, one thread where the row does not say; None where a library is not installed."""
        found = {
            TIGHT: self.detection_on_tight_boxes(),
            STOCK: self.ratio(self.fcl("stock"), "detection", BOXES),
            UPDATE: self.ratio(self.fcl(), "update", BOXES),
            SET_UP: self.ratio(self.fcl(), "set_up", BOXES),
            SET_UP_WITH_BOXES: self.ratio(self.fcl(), "set_up_with_boxes", BOXES, "set_up"),
        }
        for suffix, threads in (("", ""), (ON_2_THREADS, "_2_threads")):
            for row, boxes_and_then in TOUCHING.items():
                names = self.fcl(*boxes_and_then)
                found[row + suffix] = self.ratio(names, "frame", CAPSULES + threads)
        for key, what in EMBREE.items():
            for on, ours in (("1 thread", BOXES), ("2 threads", BOXES + "_2_threads")):
                names = self.embree(on)
                ratio = self.ratio(names, key, ours) if self.has_embree() else None
                found[f"{what}: Embree, {on}"] = ratio
        return found

    def sampled(self, boxes):
        """Pairs that fcl::collide was called on and pairs that there are, of the best."""
        name = self.best(self.fcl(boxes, COLLIDE), "frame")
        return self.median(name, "sampled"), self.median(name, "of")

    def bytes(self, name):
        return self.checked(name, "bytes_after_frames") / self.segments

    def of_fcls_bytes(self):
        return self.bytes(BOXES) / self.bytes(self.best(self.fcl(), "frame"))

    def times_the_floor(self):
        return self.median(BOXES, "update") / self.part.median("Floor", "read", "seconds")
