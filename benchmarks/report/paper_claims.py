# SPDX-License-Identifier: BSD-3-Clause
"""Numbers that answer single claims of the paper, and what it left for later.

The verdicts are in docs/paper.md.
"""

import numpy as np

from paper import numbered, steps
from paper_cascade import WELZL
from paper_table import DEFAULT, PUBLISHED
from tables import Table, chosen, count, digits, percent

BOXES, SPHERES = PUBLISHED["boxes"], PUBLISHED["spheres"]
WHO = {
    BOXES: "boxes, as published",
    SPHERES: "spheres, as published",
    DEFAULT["boxes"]: "boxes, by default",
    DEFAULT["spheres"]: "spheres, by default",
}


def exponent(points):
    """Of a power of the first number that fits the second best."""
    x, y = np.log(np.array(list(points))).T
    return np.polyfit(x, y, 1)[0]


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


REPLAYS = {
    "replay": "the loop",
    "replay_turned": "the loop, turned",
    "replay_recorded": "recorded loads",
}


def correlations(part, motion):
    """Of the times of detection with what is found."""
    touching = np.array(steps(part, "LayeredAABBTree/capsules", "pairs"))[:, 1]
    for name in (BOXES, SPHERES, DEFAULT["boxes"]):
        detection = np.array(steps(part, name, "detection"))[:, 1]
        pairs = np.array(steps(part, name, "pairs"))[:, 1]
        for what, numbers in (("touching pairs", touching), ("pairs reported", pairs)):
            found = np.corrcoef(numbers, detection)[0, 1]
            row = f"correlation of detection with the {what}, by steps of {motion}"
            yield "4.1", row, WHO[name], digits(found, 2)
    what = f"pairs of a step, {motion}"
    reported = np.array(steps(part, BOXES, "pairs"))[:, 1]
    for who, numbers in (("touching", touching), ("overlapping boxes", reported)):
        yield "4.1", what, who, span(numbers, count)


def dynamic(parts):
    for name, motion in REPLAYS.items():
        if name in parts:
            yield from correlations(parts[name], motion)
    part = parts.get("replay")
    if part is None:
        return
    for name in (BOXES, SPHERES):
        update = np.array(steps(part, name, "update"))[:, 1]
        what = "slowest / fastest update of the dynamic assembly"
        yield "4.1", what, WHO[name], digits(update.max() / update.min(), 2)
    made, kept = (
        np.array(steps(part, SPHERES, "cages_" + what))[:, 1] for what in ("recomputed", "kept")
    )
    shares = made / (made + kept)
    what = "cages recomputed in a median step, and in the worst"
    shown = f"{percent(np.median(shares), 1)} / {percent(shares.max(), 1)}"
    yield "3.1", what, WHO[SPHERES], shown


def span(values, form):
    """Least and greatest."""
    low, high = form(min(values)), form(max(values))
    return low if low == high else f"{low} to {high}"


def welzl(parts):
    """How Welzl's algorithm grows, and whether it has peaks."""
    sizes = list(numbered(parts, "cascade_static").values())
    if len(sizes) < 2:
        return
    segments = [part.median("Root", "welzl", "segments") for part in sizes]
    for name, who in WELZL.items():
        root = [part.median("Root", name, "ball_tests") for part in sizes]
        what = "power of the segments that the tests of balls of {} grow with"
        yield "2.3", what.format("one sphere"), who, digits(exponent(zip(segments, root)))
        each = [tests / balls for tests, balls in zip(root, segments)]
        yield "2.3", "tests of balls of one sphere / segments", who, ratio_span(each)
        tree = [part.median("Cascade", f"anew/{name}", "ball_tests") for part in sizes]
        yield "2.3", what.format("a tree"), who, digits(exponent(zip(segments, tree)))
        for kind, of, where in (
            ("Root", "one sphere", name),
            ("Cascade", "all spheres", f"anew/{name}"),
            ("Cascade", "the spheres that leaves have left", f"where_it_was/{name}"),
        ):
            runs = [part.runs(kind, where, "ball_tests") for part in sizes]
            what = f"tests of balls of {of}, most at a size / least at a size 1.5 times as large"
            yield "4.1", what, who, digits(peak(segments, runs), 2)
        what = "making all spheres of the static assembly / making its boxes"
        yield "4.1", what, who, ratio_span(builds(sizes, f"anew/{name}", "boxes/union"))
    for name, who in (("basis", "each leaf"), ("library", "the library's, by cages below")):
        tests = [part.median("Cascade", f"{name}/exact", "tests") for part in sizes]
        what = "power of the segments that the tests of cascade verification grow with"
        yield "3.1", what, who, digits(exponent(zip(segments, tests)))
    what = "making all spheres by Welzl's algorithm / by the library's"
    yield "3", what, "static assembly", ratio_span(builds(sizes, "anew/welzl", "anew/exact"))
    sizes_of = [sizes[0].median("Cascade", f"boxes/{name}", "bytes") for name in ("union", "basis")]
    what = "bytes of a box, alone and with its basis"
    yield "3.1", what, "boxes", " / ".join(map(count, sizes_of))


def peak(segments, runs):
    """The most of a run at one size as a multiple of the least at a size 1.5 times as large or
    more: above 1 where fewer segments take longer."""
    return max(
        runs[i].max() / runs[j].min()
        for i, few in enumerate(segments)
        for j, many in enumerate(segments)
        if many >= 1.5 * few
    )


def builds(parts, name, other):
    """The times of making all volumes, as multiples of the other's."""
    return [
        part.median("Cascade", name, "build") / part.median("Cascade", other, "build")
        for part in parts
    ]


def ratio_span(values):
    return span(values, lambda value: digits(value, 2))


def loose(parts):
    """What cages cost that stayed where they were."""
    for name, part in chosen(parts, "cascade", ("static", "dynamic")).items():
        tests = [
            part.median("Cascade", f"{kept}/exact", "volume_tests")
            for kept in ("where_it_was", "anew")
        ]
        what = "volume tests with cages kept where they were / with the least ones"
        yield "3.1", what, f"{name} assembly", digits(tests[0] / tests[1])


def table(parts):
    makers = (axes, dynamic, static, welzl, loose)
    rows = sorted((row for make in makers for row in make(parts)), key=lambda row: row[:2])
    return Table(
        "paper-claims",
        "Numbers for single claims",
        ["section", "of", "value"],
        [[f"{section} {what}", of, value] for section, what, of, value in rows],
        "Times of the dynamic assembly are medians of the replays.",
    )
