# SPDX-License-Identifier: BSD-3-Clause
"""Tables of the sets headline and full."""

import math

import ratios
from ratios import BOXES, EMBREE, ON_2_THREADS, Scene, ratio_of
from tables import Rows, Table, chosen, count, digits, time, time_and_range, title

HEADLINE, FULL = ("helix", "cap", "paper-dynamic"), ratios.SCENES
SPEED_UP = "Speed-up over"
ABSENT = "not installed"
PHASES = ("set_up", "update", "detection", "frame")
PHASE_TITLES = ["set-up", "update", "detection", "update + detection"]
SET_UP_TITLES = ["set-up, boxes written before", "set-up with boxes"]
READ_RATIOS = (
    "Each cell is the ratio of two medians, on one thread unless the row says otherwise. The "
    "brackets have the lowest and the highest ratio that single runs allow. A cell says 'as fast' "
    "where that range contains 1. Each row is against FCL's tree and level with the least median "
    "of what the row measures. Cells of update and set-up name FCL's boxes, tight or stock. An "
    "update of FCL's has writing them inside, its set-up only where the row says so. Embree's way "
    "is the fastest of a Morton rebuild, a refit and, with --full, a rebuild by surface area; it "
    "visits both orders of each pair. Touching pairs are an update and a query: ours with "
    "Report::kCapsules, FCL's with a closed-form test of two capsules in its callback, or with "
    "fcl::collide on the pairs that it reports."
)


def scenes_of(parts):
    """By name, those that were measured."""
    found = chosen(parts, "frames_{}", (*FULL, "hair"))
    return {name: Scene(name, part) for name, part in found.items()}


def ratio_cells(scenes, row):
    found = [scene.ratios()[row] for scene in scenes.values()]
    any_boxes = row in (ratios.UPDATE, ratios.SET_UP, ratios.SET_UP_WITH_BOXES)
    return [ABSENT if ratio is None else ratio.text(any_boxes) for ratio in found]


def row_title(scenes, row):
    """With the size of the sample, where fcl::collide was not called on all pairs."""
    if not row.startswith((ratios.TOUCHING_TIGHT, ratios.TOUCHING_STOCK)):
        return row
    boxes = "tight" if row.startswith(ratios.TOUCHING_TIGHT) else "stock"
    found = [scene.sampled(boxes) for scene in scenes.values()]
    sizes = sorted(sampled for sampled, of in found if sampled < of)
    if not sizes:
        return row
    sizes = dict.fromkeys([count(sizes[0]), count(sizes[-1])])
    return f"{row} (estimated from {' to '.join(sizes)} pairs)"


def header_of(scenes, what=""):
    return [what, *(scene.title() for scene in scenes.values())]


def headline(scenes):
    """The rows that say most; all_ratios() has the others."""
    rows = (ratios.TIGHT, ratios.UPDATE, ratios.TOUCHING_TEST, ratios.TOUCHING_TIGHT)
    lines = [[row_title(scenes, row), *ratio_cells(scenes, row)] for row in rows]
    what = EMBREE["frame"] + ": Embree, "
    both = zip(*(ratio_cells(scenes, what + on) for on in ("1 thread", "2 threads")))
    cells = [ABSENT if ABSENT in pair else " / ".join(pair) for pair in both]
    lines.append([what + "1 thread / 2 threads", *cells])
    header = header_of(scenes, SPEED_UP)
    return Table("headline", "Headline", header, lines, READ_RATIOS)


def all_ratios(scenes):
    rows = Rows(scenes.values())
    for row in rows.columns[0].ratios():
        rows.append([row_title(scenes, row), *ratio_cells(scenes, row)])
    what = "Our update, in multiples of a loop that only reads"
    rows.add(what, lambda s: digits(s.times_the_floor(), 2) + "x")
    rows.add("Our bytes per segment, boxes", lambda s: digits(s.bytes(BOXES)))
    rows.add("Our bytes per segment, kCapsules", lambda s: digits(s.bytes(ratios.CAPSULES)))
    rows.add("Our bytes with boxes, as a share of FCL's", lambda s: digits(s.of_fcls_bytes(), 2))
    return Table("ratios", "Speed-up", header_of(scenes, SPEED_UP), rows, READ_RATIOS)


def best(scenes):
    """Whom the ratios are against."""
    found = [scene.ratios() for scene in scenes.values()]
    rows = [row for row in found[0] if not row.endswith(ON_2_THREADS)]
    who = [
        [row] + [title(scene[row].against) if scene[row] else ABSENT for scene in found]
        for row in rows
    ]
    for on, suffix in (("1 thread", ""), ("2 threads", "_2_threads")):
        cells = [visited_ratio(scene, on, BOXES + suffix) for scene in scenes.values()]
        what = f"Detection per visited pair: speed-up over Embree, {on}"
        who.append([what, *cells])
    caption = "Whom each row compares with. Ours visits each pair once, Embree in both orders."
    return Table("best", "The fastest of the others", header_of(scenes), who, caption)


def per_visited(scene, name):
    """Nanoseconds by run."""
    return 1e9 * scene.part.runs("Frames", name, "detection") / scene.median(name, "visited")


def visited_ratio(scene, on, ours):
    if not scene.has_embree():
        return ABSENT
    against = min(scene.embree(on), key=lambda name: per_visited(scene, name).median())
    return ratio_of(per_visited(scene, against), per_visited(scene, ours), against).text()


def scene_table(scene, ranges=False):
    """`ranges`: of all times, not of a frame's alone."""
    part, rows = scene.part, []
    for name in sorted(scene.contenders, key=order_of):
        cells = []
        for key in ("set_up", ratios.set_up_key(name), *PHASES[1:]):
            form = time_and_range if ranges or key == "frame" else lambda runs: time(runs.median())
            known = part.knows("Frames", name, key)
            cells.append(form(part.runs("Frames", name, key)) if known else "-")
        counts, then = ["-"] * 4, ratios.after_query(name)
        if then:
            both = [count(scene.median(name, key)) for key in ("pairs", "touching")]
            counts = [both[0], "-", both[1] if then == ratios.TEST else "~" + both[1], "-"]
        elif part.knows("Frames", name, "visited"):
            counts = [count(scene.median(name, "pairs")), digits(per_visited(scene, name).median())]
            counts += [count(scene.checked(name, "touching")), digits(scene.bytes(name))]
        rows.append([title(name), *cells, *counts, str(len(part.counters("Frames", name)))])
    floor = part.runs("Floor", "read", "seconds")
    cells = ["-", "-", time(floor.median()), *["-"] * 6, str(len(floor))]
    rows.append(["a loop that only reads the objects", *cells])
    header = ["", *SET_UP_TITLES, *PHASE_TITLES[1:], "pairs", "ns per visited pair", "touching"]
    header += ["bytes per segment", "runs"]
    caption = (
        "Times are medians, with the lowest and the highest in brackets. 'And test' is a "
        "closed-form test of two capsules in the callback. 'And collide' is fcl::collide; its "
        "detection and ~ are scaled up from the sample. Only FCL's managers read boxes that "
        "somebody has written. A tree of FCL's that was fastest in some phases alone, when all "
        "were tried, has only these."
    )
    if scene.name == "paper-dynamic":
        steps = count(scene.median(BOXES, "frames"))
        caption += f" Times and pairs are sums over {steps} steps."
        caption += " Touching pairs are of the middle step."
    if not_timed(scene):
        caption += f" Not timed: {'; '.join(not_timed(scene))}."
    return Table(f"scene {scene.name}", scene.title(), header, rows, caption)


def order_of(name):
    """Ours first; of one tree of FCL's the query, then with a test, then with fcl::collide."""
    then = ratios.after_query(name)
    place = ("", ratios.TEST, ratios.COLLIDE).index(then)
    return not name.startswith("Layered"), name.removesuffix(then), place


def not_timed(scene):
    notes = {name: scene.part.note(name) for name in scene.part.names("Checked")}
    notes.update(scene.part.errors)
    return [f"{title(name)} ({note})" for name, note in notes.items() if note]


def tried(scene):
    """FCL's trees at every level."""
    found = {name: scene.part.counters("Tried", name).iloc[0] for name in scene.part.names("Tried")}
    rows = [
        [title(name), *("-" if math.isnan(row[key]) else time(row[key]) for key in PHASES)]
        for name, row in sorted(found.items(), key=lambda entry: entry[1]["frame"])
    ]
    segments = next(iter(found.values()))["segments"]
    caption = (
        f"Each was run once, on {segments:,.0f} segments. The fastest of each column was measured; "
        "in the last two columns, the fastest with either boxes."
    )
    return Table(
        f"tried {scene.name}", f"FCL's levels, {scene.title()}", ["", *PHASE_TITLES], rows, caption
    )


def growth_of(part, key):
    """Medians by size, smallest first."""
    return [part.median("Growth", size, key) for size in sorted(part.names("Growth"), key=int)]


def growth(part):
    sizes = [f"{size:,.0f} segments" for size in growth_of(part, "segments")]
    rows = []
    for key in ("update", "detection"):
        found = growth_of(part, key)
        cells = [digits(1e9 * value) + " ns" for value in found]
        rows.append([key, *cells, digits(found[-1] / found[0]) + "x"])
    for key, what in (("answer", "pairs"), ("bytes", "bytes")):
        rows.append([what, *(digits(value) for value in growth_of(part, key)), "-"])
    header = ["FiberTree, per segment", *sizes, "last / first"]
    return Table("growth", "Growth", header, rows, "Helices of 100 segments at one density.")
