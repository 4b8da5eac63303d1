# SPDX-License-Identifier: BSD-3-Clause
"""Tables and the picture of the set card: FCL's managers and ours on the paper's scenes.

The scenes are climbed: at each size each contender is checked once, and one that has ended has no
rows at larger sizes. At the full size those that are left are timed.
"""

import math

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from measured_sets import titles
from pictures import INK, count_label, log_axis, png, seconds_label
from ratios import FCL, is_fcls, ratio_of, set_up_key
from tables import Table, count, digits, time, title

SCALARS = ("double", "float")
PHASES = {"set_up": "construction", "update": "update", "detection": "detection"}
OURS = ("LayeredAABBTree", "WrappedSphereTree")
REFERENCE = "LayeredAABBTree/bundles"
ORDER = (*OURS, *FCL)
VARIANTS = ("bundles", "published", "stock", "stock_anew", "tight", "tight_anew")
READ = (
    "Each cell has double / float, medians on one thread. FCL's managers are as FCL makes them; "
    "they read boxes that were written before, and 'with boxes' has that inside, as update has. "
    "Pairs are those handed to the callback, adjacent segments among them. A manager that "
    "crashes, is wrong or takes longer than the limit in a phase is not run at larger sizes. "
    "Growth is of the phase that ran out, else of the slower of update and detection, over the "
    "sizes at which it ended in time. The times of a climb are of one check, whose callback keeps "
    "the pairs. The strand has one area for any number of fibers, so that its density grows too."
)
SUMMARY = (
    "Update + detection at the full size, as a multiple of the box tree over bundles, in double "
    "and on one thread. A manager of FCL has the better of stock and tight boxes, which the cell "
    "names. The cell of a manager that is out has the reason, and the size at which it was out."
)
PICTURE = (
    "Seconds of one update and one detection in double, each manager of FCL on the better of its "
    "boxes, by one check at each size, whose callback keeps the pairs. A cross is the last size "
    "before it ended; a dotted line leads from there to its name."
)


def scenes():
    """What they are called, each measured in both scalars."""
    return {
        name[: -len("_double")]: title
        for name, title in titles("card").items()
        if name.endswith("_double")
    }


def place(name):
    """Ours first, then FCL's in the order of ratios.FCL."""
    manager, variant = name.split("/")
    return ORDER.index(manager), VARIANTS.index(variant)


class Climb:
    """One scene in one scalar."""

    def __init__(self, scene, part):
        self.scene, self.part = scene, part
        self.sizes = {}  # of a contender, ascending
        for row in part.names("Card"):
            name, size = row.rsplit("/", 1)
            self.sizes.setdefault(name, []).append(int(size))
        for sizes in self.sizes.values():
            sizes.sort()
        self.names = sorted(self.sizes, key=place)
        self.full = max(size for sizes in self.sizes.values() for size in sizes)

    def at(self, name, size, key):
        return self.part.median("Card", f"{name}/{size}", key)

    def title(self):
        fibers = next(self.at(n, self.full, "fibers") for n in self.names if self.reached(n))
        each = self.full / fibers
        size = f"{each:,.0f}" if each == int(each) else digits(each)
        steps = f", {count(self.steps())} steps" if self.scene == "dynamic" else ""
        return f"{scenes()[self.scene]}, {fibers:,.0f} x {size}{steps}"

    def reached(self, name):
        return self.sizes[name][-1] == self.full

    def note(self, name):
        """Why it ended, or nothing."""
        last = self.part.note(f"{name}/{self.sizes[name][-1]}", "Card")
        if not last and not self.reached(name):
            raise ValueError(f"{self.part.file}: {name} ends without a reason")
        return last

    def finished(self, name):
        """The sizes at which it ended in time and right."""
        return self.sizes[name][:-1] if self.note(name) else self.sizes[name]

    def growth(self, name):
        """The phase that ran out, else the slower of a frame, and its power of the segments: the
        line through all sizes, as a check is one run."""
        sizes = self.finished(name)
        if len(sizes) < 2:
            return ""
        words = self.note(name).split()
        ended = next((key for key in PHASES if key in words), "")
        phase = ended or max(("update", "detection"), key=lambda p: self.at(name, sizes[-1], p))
        seconds = [self.at(name, size, phase) for size in sizes]
        power = np.polyfit(np.log(sizes), np.log(seconds), 1)[0]
        return f"{'it' if ended else PHASES[phase]} grows as n^{power:.1f}"

    def end(self, name):
        """Why and from where on it is out, as `>20 s in update from 22,400 segments on`."""
        note, sizes = self.note(name), self.sizes[name]
        for key, phase in PHASES.items():
            note = note.replace(f"in {key}", f"in {phase}")
        if len(sizes) == 1:
            return f"{note} at the smallest size already, {sizes[0]:,} segments"
        return f"{note} from {sizes[-1]:,} segments on"

    def verdict(self, name):
        if name in self.part.errors:
            return self.part.errors[name]
        if self.is_too_long(name):
            seconds = self.steps() * self.at(name, self.full, "frame")
            return f"not timed: all steps would take about {time(seconds)}"
        end = [self.end(name)] if self.note(name) else []
        return "; ".join(end + [text for text in [self.growth(name)] if text])

    def steps(self):
        """Of the motion."""
        first = next(name for name in self.names if self.part.has("Frames", name))
        return self.part.median("Frames", first, "frames")

    def is_too_long(self, name):
        """A step ended in time, and all steps of the motion were not run."""
        has_frames = self.part.has("Frames", name)
        return self.scene == "dynamic" and not self.note(name) and not has_frames

    def is_timed(self, name):
        return not (self.note(name) or name in self.part.errors or self.is_too_long(name))

    def timed(self, name, key):
        """At the full size, or None where it was not reached."""
        if not self.is_timed(name):
            return None
        if key == "bytes":
            return self.at(name, self.full, "bytes_after_frames") / self.full
        return self.part.median("Frames", name, key)

    def times(self, name):
        """As long as the reference takes for a frame."""
        theirs, ours = (self.part.runs("Frames", n, "frame") for n in (name, REFERENCE))
        return ratio_of(theirs, ours)

    def frame(self, name):
        return self.timed(name, "frame")


def both(values, form):
    """Of all scalars, as `12.1 ms / 11.5 ms`."""
    texts = ["-" if value is None else form(value) for value in values]
    return "-" if set(texts) == {"-"} else " / ".join(texts)


def same(texts):
    """One text where double and float have the same."""
    found = [text for text in texts if text is not None]
    if len(set(found)) == 1:
        return found[0]
    return "; ".join(f"{scalar}: {text or '-'}" for scalar, text in zip(SCALARS, texts))


def scene_table(scene, parts):
    found = [parts.get(f"card_{scene}_{scalar}") for scalar in SCALARS]
    climbs = [part and Climb(scene, part) for part in found]
    known = [climb for climb in climbs if climb]

    def of(name, key):
        return [
            climb.timed(name, key) if climb and name in climb.sizes else None for climb in climbs
        ]

    rows = []
    for name in sorted({name for climb in known for name in climb.names}, key=place):
        keys = ("set_up", set_up_key(name), "update", "detection", "frame")
        cells = [both(of(name, key), time) for key in keys]
        cells += [both(of(name, "bytes"), digits), both(of(name, "pairs"), count)]
        verdicts = [c.verdict(name) if c and name in c.sizes else None for c in climbs]
        rows.append([title(name), *cells, same(verdicts) or "-"])
    header = ["", "construction, boxes written before", "construction with boxes", "update"]
    header += ["detection", "update + detection", "bytes per segment", "pairs handed on"]
    header += ["ended, or growth"]
    caption = READ
    if scene == "dynamic":
        caption += " Times and pairs are sums over the steps."
    return Table(f"card-scene {scene}", known[0].title(), header, rows, caption)


def climbs_of(parts):
    """Those in double."""
    found = ((scene, parts.get(f"card_{scene}_double")) for scene in scenes())
    return [Climb(scene, part) for scene, part in found if part]


def best(climb, manager):
    """Of its variants the one that got furthest, and of these the fastest."""

    def rank(name):
        sizes = climb.finished(name)
        last = climb.at(name, sizes[-1], "frame") if sizes else math.inf
        seconds = climb.frame(name) if climb.is_timed(name) else last
        return -(sizes[-1] if sizes else 0), seconds

    names = [name for name in climb.names if name.split("/")[0] == manager]
    return min(names, key=rank) if names else None


def summary(parts):
    """One row a manager, one column a scene."""
    climbs = climbs_of(parts)
    rows = []

    def cell(climb, name):
        if name is None or name not in climb.sizes:
            return "-"
        variant = f", {title(name.split('/')[1])}" if is_fcls(name) else ""
        if not climb.is_timed(name):
            return climb.verdict(name).split("; ")[0] + variant
        if name == REFERENCE:
            return time(climb.frame(name))
        return climb.times(name).text() + variant

    for manager in OURS:
        for variant in ("bundles", "published"):
            name = f"{manager}/{variant}"
            rows.append([title(name), *(cell(climb, name) for climb in climbs)])
    for manager, label in FCL.items():
        rows.append([label, *(cell(climb, best(climb, manager)) for climb in climbs)])
    header = ["", *(climb.title() for climb in climbs)]
    return Table("card", "FCL's managers and ours on the paper's scenes", header, rows, SUMMARY)


# Okabe-Ito colours and a grey, with markers, which also tell them apart without colour.
LINES = {
    "LayeredAABBTree": ("#0072b2", "o"),
    "WrappedSphereTree": ("#009e73", "s"),
    "DynamicAABBTree": ("#e69f00", "^"),
    "DynamicAABBTree_Array": ("#d55e00", "v"),
    "SaP": ("#8a4f9e", "P"),
    "SSaP": ("#cc79a7", "D"),
    "IntervalTree": ("#56b4e9", "p"),
    "SpatialHashing": ("#8a8f99", "h"),
    "Naive": ("#1d2330", "*"),
}


def lines_of(climb):
    """(label, contender) of the lines that a panel has."""
    ours = [name for name in climb.names if name.split("/")[0] in OURS]
    lines = [(title(name), name) for name in ours]
    for manager, label in FCL.items():
        name = best(climb, manager)
        if name:
            lines.append((f"{label}, {title(name.split('/')[1])}", name))
    return lines


def apart(heights, least):
    """As near to these heights as they can be, ascending and so far from each other."""
    groups = [[height, 1] for height in heights]  # the middle, and how many

    def overlap(a, b):
        return b[0] - a[0] < least * (a[1] + b[1]) / 2

    k = 0
    while k + 1 < len(groups):
        a, b = groups[k : k + 2]
        if overlap(a, b):
            groups[k : k + 2] = [[(a[0] * a[1] + b[0] * b[1]) / (a[1] + b[1]), a[1] + b[1]]]
            k = max(k - 1, 0)
        else:
            k += 1
    return [middle + least * (i - (n - 1) / 2) for middle, n in groups for i in range(n)]


def label_ends(axis, climb, ends):
    """`ends`: (text, point, colour) of lines. All labels stand at the right, in the order of their
    lines; a dotted line leads there from one that ended earlier."""
    pixel = axis.figure.dpi / 72
    ends = sorted(ends, key=lambda end: end[1][1])
    heights = [axis.transData.transform(point)[1] for _, point, _ in ends]
    for (text, point, colour), at, height in zip(ends, heights, apart(heights, 10.5 * pixel)):
        if point[0] < climb.full:
            dotted = {"color": colour, "lw": 0.8, "ls": ":", "zorder": 2}
            axis.plot([point[0], climb.full], 2 * [point[1]], **dotted)
        place = {"xytext": (14, (height - at) / pixel), "textcoords": "offset points"}
        place |= {"va": "center", "fontsize": 8.2, "color": colour, "annotation_clip": False}
        arrow = {"arrowstyle": "-", "color": colour, "lw": 0.6, "relpos": (0, 0.5)}
        arrow |= {"shrinkA": 0, "shrinkB": 0}
        axis.annotate(text, (climb.full, point[1]), arrowprops=arrow, **place)


def draw_climb(axis, climb):
    ends, absent = [], []
    for label, name in lines_of(climb):
        colour, marker = LINES[name.split("/")[0]]
        sizes = climb.finished(name)
        if not sizes:
            absent.append(label)
            continue
        points = [(size, climb.at(name, size, "frame")) for size in sizes]
        ours = not is_fcls(name)
        line = {"color": colour, "marker": marker, "lw": 2.2 if ours else 1.3, "ms": 4.5}
        line |= {"ls": "--" if name.endswith("/published") else "-", "zorder": 4 if ours else 3}
        axis.plot(*zip(*points), **line)
        if climb.note(name):
            cross = {"marker": "x", "color": INK, "ms": 9, "mew": 1.6, "zorder": 5}
            axis.plot(*points[-1], **cross)
        ends.append((label, points[-1], colour))
    axis.set_title(climb.title(), pad=17)
    axis.set_xlabel("segments, logarithmic")
    log_axis(axis.xaxis, count_label)
    log_axis(axis.yaxis, seconds_label)
    if climb.full <= 20 * min(sizes[0] for sizes in climb.sizes.values()):
        axis.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axis.xaxis.set_major_formatter(FuncFormatter(count_label))
    axis.xaxis.set_minor_formatter(NullFormatter())
    if absent:
        text = "ended at the smallest size: " + ", ".join(absent)
        axis.text(0, 1.015, text, transform=axis.transAxes, fontsize=8.2, color=INK)
    return ends


def picture(parts):
    """A panel for each scene that was climbed."""
    climbs = [
        climb for climb in climbs_of(parts) if len({s for n in climb.sizes.values() for s in n}) > 1
    ]
    rows = max(1, math.ceil(len(climbs) / 2))
    figure = Figure(figsize=(13, 4.9 * rows))
    axes = figure.subplots(rows, 2, squeeze=False).ravel()
    ends = [draw_climb(axis, climb) for axis, climb in zip(axes, climbs)]
    for axis in axes[len(climbs) :]:
        axis.set_visible(False)
    for axis in axes[::2]:
        axis.set_ylabel("update + detection, logarithmic")
    figure.tight_layout(w_pad=13, h_pad=2, rect=(0, 0, 0.86, 1))
    for axis, climb, found in zip(axes, climbs, ends):
        label_ends(axis, climb, found)
    return png(figure)
