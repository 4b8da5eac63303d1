# SPDX-License-Identifier: BSD-3-Clause
"""The ten rows of docs/performance.md, of the set full."""

import elsewhere
import frames
import motion
import obstacles
import ratios
from machines import MainTable

CAPTION = (
    "How many times as fast ours is in the scene, and beside the library, where it gains least, "
    "with that scene's interval; below 1 the other is faster. " + ratios.READ
)


def least(found):
    """Of ratios; None stands for a library that was not measured."""
    known = [ratio for ratio in found if ratio is not None]
    return min(known, key=lambda ratio: ratio.value).text() if known else "-"


def of_frames(parts):
    scenes = frames.scenes_of(parts)
    for rows, what in (
        (
            (ratios.TIGHT, ratios.COAL_TIGHT),
            "all pairs of boxes: detection by FCL's or coal's fastest tree, tight boxes",
        ),
        ((ratios.UPDATE, ratios.COAL_UPDATE), "update: FCL's or coal's fastest tree, any boxes"),
        (
            (ratios.SET_UP_WITH_BOXES, ratios.SET_UP_OF_COAL),
            "set-up: FCL's or coal's fastest tree, any boxes",
        ),
        ((ratios.TOUCHING_TEST,), "what touches, a frame: FCL's tree, a closed-form test"),
        ((ratios.COAL_TEST,), "what touches, a frame: coal's tree, a closed-form test"),
        ((ratios.GRID_TEST,), "what touches, a frame: a uniform grid, a closed-form test"),
        (
            (ratios.EMBREE_TEST,),
            "what touches, a frame: Embree's tree (both orders), a closed-form test",
        ),
    ):
        if scenes:
            yield what, least([scene.ratio(row) for scene in scenes.values() for row in rows])


def of_others(parts):
    found = [row for row in obstacles.rows_of(parts) if row.faster]
    hair = [row.ratio for row in found if ": by the manager" in row.what]
    if hair:
        yield "hair that touches its head: FCL's tree and fcl::collide", least(hair)
    moved = [found.against_the_fastest() for found in motion.motions_of(parts).values()]
    if moved:
        what = "what touches in a step of motion: the fastest tree of swept boxes, ours among them"
        yield what, least(moved)
    if "clients" in parts:
        rows = elsewhere.client_rows(parts["clients"])
        small = [row.ratio for row in rows if row.what.endswith(", update + self-collision")]
        yield "small scenes, a frame: FCL's fastest manager", least(small)


def table(parts):
    cells = dict([*of_frames(parts), *of_others(parts)])
    return MainTable("summary", "In ten rows", cells, CAPTION)
