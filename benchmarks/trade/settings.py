# SPDX-License-Identifier: BSD-3-Clause
"""What the parts have measured as settings: (name, seconds, what it trades), scene by scene."""

import math
from dataclasses import dataclass

from figures import count_label

SCENES = {
    "static": "Strand of 1,000 × 100 long segments (static)",
    "strand": "Strand of 1,000 × 2,000 short segments",
    "half_scalp": "A tenth of the half scalp, 5,000 × 50",
    "dynamic": "Dynamic assembly, 150 × 100, half way",
    "hair": "Hair from a file",
}
SHORT = {
    "static": "strand, 1,000 × 100",
    "strand": "strand, 1,000 × 2,000",
    "half_scalp": "half scalp, a tenth",
    "dynamic": "dynamic assembly",
    "hair": "hair",
}
# Ours in colour, FCL's in grey; okabe-ito colours, which most eyes tell apart.
OURS = {
    "LayeredAABBTree/bundle": ("boxes", "#0072b2", "o"),
    "LayeredAABBTree/bundle_capsules": ("boxes, capsules out", "#56b4e9", "D"),
    "LayeredAABBTree/super_thread": ("boxes, super thread", "#d55e00", "o"),
    "WrappedSphereTree/bundle": ("spheres", "#009e73", "s"),
    "WrappedSphereTree/bundle_capsules": ("spheres, capsules out", "#60c8a8", "D"),
    "WrappedSphereTree/super_thread": ("spheres, super thread", "#9b3f8f", "s"),
}
FCL = {
    "DynamicAABBTree": ("FCL dynamic tree", "^"),
    "DynamicAABBTree_Array": ("FCL dynamic tree, array", "v"),
    "SaP": ("FCL SaP", "P"),
    "SSaP": ("FCL SSaP", "X"),
    "IntervalTree": ("FCL interval tree", "<"),
    "SpatialHashing": ("FCL spatial hashing", ">"),
    "Naive": ("FCL naive", "x"),
}
DIRECTIONS = {"6_double": "6 double", "6": "6", "14": "14", "18": "18", "26": "26"}
CAGES = {
    "verified": "verified",
    "exact": "exact",
    "core_set_20": "core set 20",
    "core_set_5": "core set 5",
    "Ritter": "Ritter",
    "centroid": "centroid",
}
SAMPLINGS = (25, 50, 100, 200, 400, 1000, 2000)  # segments a fiber; the last is the truth
STRAND_RADIUS = 0.0035  # cm, of makeHelix()
LAZY_FRAMES = 100  # updates of a run of the lazy part: the dynamic assembly has 101 states


def title_of(name):
    if name in OURS:
        return OURS[name][0]
    manager, variant = name.split("/")
    return f"{FCL[manager][0]}, {variant} boxes"


def contacts_of(counters):
    """Adjacent segments always touch, and are nothing that a program looks for."""
    adjacent = counters.get("segments", 0) - counters.get("fibers", 0)
    return counters.get("touching", 0) - adjacent


def points_of(part):
    """(name, seconds a frame, false pairs per contact), fastest first."""
    points = []
    for name, entry in part.entries.items():
        counters = entry.counters
        contacts = contacts_of(counters)
        if math.isnan(entry.total) or contacts <= 0:
            continue
        points.append((name, entry.total, (counters["pairs"] - counters["touching"]) / contacts))
    return sorted(points, key=lambda point: point[1])


def pareto(points):
    """Those that no other point beats in both."""
    front = []
    for point in sorted(points, key=lambda point: point[1:]):
        if not front or point[2] < front[-1][2]:
            front.append(point)
    return front


def entries_of(part):
    """By setting, without the scene's name at the end."""
    return {name.rsplit("/", 1)[0]: entry for name, entry in part.entries.items()}


def scenes_with(parts, prefix):
    return [scene for scene in SCENES if f"{prefix}_{scene}" in parts]


@dataclass
class Curve:
    """One scene, in the order of the dial."""

    scene: str
    points: list  # (setting, seconds, what is traded)
    kind: str = ""  # where a dial can be turned in two ways


@dataclass
class Dial:
    title: str
    time: str  # what the seconds are of
    trades: str
    labels: str  # what the settings are
    curves: list
    log: bool = True
    wide: bool = False

    def front(self, scene):
        return pareto([p for curve in self.curves if curve.scene == scene for p in curve.points])


def leaves(parts):
    curves = []
    for scene in scenes_with(parts, "leaves"):
        entries = entries_of(parts[f"leaves_{scene}"])
        points = [
            (length, entries[length].total, e.counters["tests"] / e.counters["touching"])
            for length in sorted(entries, key=int)
            for e in [entries[length]]
        ]
        curves.append(Curve(scene, points))
    trades = "pairs tried beside the tree, per touching pair"
    return Dial("Leaves", "a frame: update, detection", trades, "segments a leaf", curves)


def kdops(parts):
    curves = []
    for scene in scenes_with(parts, "kdops"):
        points = []
        for name, entry in by_directions(parts[f"kdops_{scene}"]):
            c = entry.counters
            false = (c["pairs"] - c["touching"]) / contacts_of(c)
            points.append((name, c["update"] + c["detection"], false))
        curves.append(Curve(scene, points))
    trades = "false pairs per contact"
    return Dial("k-DOPs", "a frame: update, detection", trades, "directions; 6: box", curves)


def by_directions(part):
    entries = entries_of(part)
    return [(label, entries[name]) for name, label in DIRECTIONS.items() if name in entries]


def bounds(parts):
    curves = []
    for scene in scenes_with(parts, "bounds"):
        entries = entries_of(parts[f"bounds_{scene}"])
        found = {"tests": [], "radii": [], "none": []}
        for name in sorted(entries, key=bound_order):
            kind, _, value = name.partition(":")
            points = found.get(kind)
            if points is None or (points and points[-1][2] == 0):  # the next leave no less
                continue
            label = {"tests": count_label(float(value or 0)), "radii": f"{value} r"}
            left = entries[name].counters["unresolved"] / entries["none"].counters["pairs"]
            points.append((label.get(kind, "no bound"), entries[name].total, left))
        curves += [Curve(scene, points, kind) for kind, points in found.items() if points]
    labels = "most tests of volumes; dashed: least volume that is opened, in radii"
    trades = "pairs left in pieces, per touching pair"
    return Dial("Search bound", "a query", trades, labels, curves, wide=True)


def bound_order(name):
    kind, _, value = name.partition(":")
    coarsest_first = -int(value) if kind == "radii" else int(value or 0)
    return (("none", "all", "tests", "radii").index(kind), coarsest_first)


def spheres(parts):
    curves = []
    for scene in scenes_with(parts, "spheres"):
        entries = entries_of(parts[f"spheres_{scene}"])
        exact = entries["exact"].counters["tests"]
        points = [
            (label, entries[name].total, entries[name].counters["tests"] / exact)
            for name, label in CAGES.items()
            if name in entries
        ]
        curves.append(Curve(scene, points))
    trades = "tests of volumes, those of exact ones = 1"
    return Dial("Spheres", "a frame: update, detection", trades, "cages", curves, log=False)


def lazy(parts):
    curves = []
    if "lazy" in parts:
        found = by_fatness(parts["lazy"], "volumes")
        tight = found[0][1].counters["pairs"]
        points = [
            (f"{fatness:g}", e.total / LAZY_FRAMES, e.counters["pairs"] / tight)
            for fatness, e in found
        ]
        curves.append(Curve("dynamic", points))
    trades = "pairs of volumes, those of tight ones = 1"
    labels = "fatness, radii"
    return Dial("Lazy updates", "a frame, on average", trades, labels, curves, log=False)


def by_fatness(part, report):
    """(radii, entry), the tight one first."""
    found = [(float(n.split(":")[1]), e) for n, e in part.entries.items() if n.startswith(report)]
    return sorted(found, key=lambda pair: pair[0])


def sampling(parts):
    curves = []
    if "sampling" in parts:
        entries = parts["sampling"].entries
        for kind in ("plain", "margin"):
            points = []
            for segments in SAMPLINGS:
                e = entries[f"{segments}/{kind}"]
                label = "the truth" if is_truth(segments, kind) else f"{chord_error(e):.2g} r"
                points.append((label, e.total, missed(e)))
            curves.append(Curve("strand", points, kind))
    labels = "chord error, radii; dashed: twice that as margin"
    return Dial("Sampling", "a frame: update, detection", "contacts missed", labels, curves)


def is_truth(segments, kind):
    return kind == "plain" and segments == SAMPLINGS[-1]


def chord_error(entry):
    return entry.counters["chord_error"] / STRAND_RADIUS


def missed(entry):
    return entry.counters["missed"] / entry.counters["contacts"]


DIALS = (leaves, kdops, bounds, spheres, lazy, sampling)
