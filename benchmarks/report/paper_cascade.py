# SPDX-License-Identifier: BSD-3-Clause
"""Enclosing spheres by Welzl's algorithm, and what verifies them, beside boxes."""

from measured_sets import titles
from tables import Table, chosen, digits, percent, time

BOXES = "boxes/union"
WELZL = {"welzl": "Welzl", "welzl_to_front": "Welzl, balls that stand out moved to the front"}
POLICIES = {
    "anew": "all made anew",
    "where_it_was": "kept where it was while no leaf leaves it",
    "basis": "kept while no leaf leaves the least sphere around its basis",
    "library": "kept while its basis holds, as in the library",
}
CAPTION = (
    "Update of the paper's tree in one plain loop, as a multiple of that of boxes, which the first "
    "row has; the share of the cages that are made anew; and the mean radius at the last frame, as "
    "a multiple of the least. Times are medians, and multiples of them have no intervals. The "
    "balls and boxes of segments are given, so that their fitting is in no time. Boxes are "
    "verified by those of their children, which is cheaper than by leaves. "
    "Welzl's algorithm takes its balls in random order, or in the chain's if those that stand out "
    "move to the front."
)


def cell(part, name):
    if not part.has("Cascade", name):
        return "-"
    boxes = part.median("Cascade", BOXES, "update")
    update, anew = part.medians("Cascade", name, "update", "anew")
    if name == BOXES:
        return time(update)
    text = f"{digits(update / boxes, 2)} / {percent(anew, 1)}"
    if name.startswith("boxes"):
        return text
    return f"{text} / {part.median('Cascade', name, 'loose'):.3f}"


def table(parts):
    scenes = titles("cascade")
    found = chosen(parts, "cascade", scenes)
    rules = {BOXES: "boxes, united bottom up", "boxes/basis": "boxes, kept while a basis holds"}
    spheres = {solver: f"spheres by {who}" for solver, who in WELZL.items()}
    for solver, who in {"exact": "spheres", **spheres}.items():
        rules |= {f"{kept}/{solver}": f"{who}, {what}" for kept, what in POLICIES.items()}
    rows = [[t, *(cell(part, name) for part in found.values())] for name, t in rules.items()]
    rows = [row for row in rows if set(row[1:]) != {"-"}]
    header = ["", *(scenes[name] for name in found)]
    return Table("paper-cascade", "Cascade verification", header, rows, CAPTION)
