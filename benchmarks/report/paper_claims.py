# SPDX-License-Identifier: BSD-3-Clause
"""Numbers that answer single claims of the paper, and what it left for later.

The verdicts are in docs/paper.md.
"""

import numpy as np

from paper import numbered, steps
from paper_table import DEFAULT, PUBLISHED, millions
from tables import Table, chosen, count, digits, percent, time

BOXES, SPHERES = PUBLISHED["boxes"], PUBLISHED["spheres"]
WHO = {
    BOXES: "boxes, as published",
    SPHERES: "spheres, as published",
    DEFAULT["boxes"]: "boxes, by default",
    DEFAULT["spheres"]: "spheres, by default",
}


def exponent(points):
    """Of a power of the first number that fits the second best."""
    x, y = np.log(np.array(points)).T
    return np.polyfit(x, y, 1)[0]


def chains(parts):
    for kind in ("random", "snake"):
        for name in (BOXES, SPHERES):
            points = [
                part.medians("Chain", name, "segments", "volume_tests")
                for part in numbered(parts, "chain_" + kind).values()
            ]
            if len(points) > 1:
                what = f"power of the segments that the tests of one {kind} chain grow with"
                yield "2.1", what, WHO[name], digits(exponent(points))


def radii(parts):
    part = parts.get("radii")
    if part is None:
        return
    worst = max(part.median("Radii", name, "largest_of_bound") for name in part.names("Radii"))
    what = "largest ratio of layered and wrapped radius, as a part of sqrt(h + 1)"
    yield "2.2", what, "spheres", digits(worst)


def axes(parts):
    if "axis_turned_0" not in parts or "axis_turned_1" not in parts:
        return
    what = "detection of fibers turned by pi/4 twice / of the same along an axis"
    for name, who in WHO.items():
        turned, straight = (
            parts[f"axis_turned_{i}"].median("Frames", name, "detection") for i in (1, 0)
        )
        yield "2.3", what, who, digits(turned / straight, 2)


def static(parts):
    assemblies = list(numbered(parts, "static").values())
    if len(assemblies) < 2:
        return
    for phase, word in (("set_up", "construction"), ("update", "update")):
        for name in (BOXES, SPHERES):
            points = [
                (part.median("Checked", name, "segments"), part.median("Frames", name, phase))
                for part in assemblies
                if part.has("Frames", name) and part.knows("Frames", name, phase)
            ]
            what = f"power of the segments that the {word} of the static assembly grows with"
            yield "4.1", what, WHO[name], digits(exponent(points), 3)
    found = [
        part.median("Frames", SPHERES, "detection") / part.median("Frames", BOXES, "detection")
        for part in assemblies
        if part.has("Frames", SPHERES) and part.knows("Frames", SPHERES, "detection")
    ]
    what = "detection of the static assembly with spheres / with boxes, least and largest"
    yield "4.1", what, "as published", f"{digits(min(found), 2)} to {digits(max(found), 2)}"


def dynamic(parts):
    part = parts.get("replay")
    if part is None:
        return
    touching = np.array(steps(part, "LayeredAABBTree/capsules", "pairs"))[:, 1]
    for name in (BOXES, SPHERES, DEFAULT["boxes"]):
        detection = np.array(steps(part, name, "detection"))[:, 1]
        pairs = np.array(steps(part, name, "pairs"))[:, 1]
        for what, numbers in (("touching pairs", touching), ("pairs reported", pairs)):
            found = np.corrcoef(numbers, detection)[0, 1]
            row = f"correlation of detection with the {what}, by steps"
            yield "4.1", row, WHO[name], digits(found, 2)
    for name in (BOXES, SPHERES):
        update = np.array(steps(part, name, "update"))[:, 1]
        what = "slowest / fastest update of the dynamic assembly"
        yield "4.1", what, WHO[name], digits(update.max() / update.min(), 2)
    made, kept = (
        np.array(steps(part, SPHERES, "cages_" + what))[:, 1] for what in ("recomputed", "kept")
    )
    shares = made / (made + kept)
    what = "cages recomputed in a median step, and in the worst"
    shown = f"{percent(np.median(shares), 1)}, {percent(shares.max(), 1)}"
    yield "3.1", what, WHO[SPHERES], shown


def table(parts):
    makers = (chains, radii, axes, dynamic, static)
    rows = sorted(row for make in makers for row in make(parts))
    return Table(
        "paper-claims",
        "Numbers for single claims",
        ["section", "of", ""],
        [[f"{section} {what}", of, value] for section, what, of, value in rows],
        "Times of the dynamic assembly are the least over the replays.",
    )


KINDS = {
    "boxes": "boxes",
    "polytopes_14": "14-DOPs",
    "polytopes_18": "18-DOPs",
    "polytopes_26": "26-DOPs",
    "layered_spheres": "layered spheres",
    "wrapped_spheres": "wrapped spheres",
    "oriented_boxes": "oriented boxes",
    "layered_oriented_boxes": "oriented boxes, layered (Lotan et al.)",
}
TREES = {"super_thread": "as published", "bundle": "by default"}
VOLUME_SCENES = {
    "static": "static assembly",
    "dynamic": "dynamic assembly",
    "strand": "loose strand of 200",
    "half-scalp": "4,000 hairs of the half scalp in wisps",
}


def volumes(parts):
    """Tests, leaf pairs and times: of boxes, and of other volumes relative to them."""
    found = chosen(parts, "volumes_{}", VOLUME_SCENES)
    keys = ("volume_tests", "leaf_pairs", "detection", "fit")
    rows = []
    for tree, when in TREES.items():
        for kind, title in KINDS.items():
            cells = []
            for part in found.values():
                sizes = part.median("Volumes", f"{tree}/{kind}", "bytes")
                of = part.medians("Volumes", f"{tree}/{kind}", *keys)
                boxes = part.medians("Volumes", f"{tree}/boxes", *keys)
                tests, pairs, *times = of
                texts = [millions(tests), count(pairs), *map(time, times)]
                if kind != "boxes":
                    texts = [digits(a / b, 2) for a, b in zip(of, boxes)]
                cells.append(" / ".join(texts))
            rows.append([f"{when}: {title}", count(sizes), *cells])
    return Table(
        "paper-volumes",
        "Other volumes",
        ["", "bytes", *(VOLUME_SCENES[name] for name in found)],
        rows,
        "Volume tests / pairs of leaves / detection / update, those of other volumes relative to "
        "boxes in the same tree.",
    )
