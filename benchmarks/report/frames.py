# SPDX-License-Identifier: BSD-3-Clause
"""Tables of the sets headline and full."""

import math

import ratios
from machines import MainTable
from ratios import BOXES, CAPSULES, ON_2_THREADS, Scene, ratio_of
from tables import Rows, Table, chosen, count, digits, time, time_and_interval, title

SPEED_UP = "Speed-up over"
PHASES = ("set_up", "update", "detection", "frame")
PHASE_TITLES = ["set-up", "update", "detection", "update + detection"]
SET_UP_TITLES = ["set-up, boxes written before", "set-up with boxes"]
READ_RATIOS = ratios.READ + (
    " On one thread unless the row says otherwise. Each row is against the configuration with the "
    "least median of what the row measures. Cells of update and set-up, and of coal's touching "
    "pairs, name the boxes, tight or stock. All updates write or read their boxes inside, and so "
    "do all set-ups except the one whose row tells that FCL's boxes were written before. Touching "
    "pairs are an update and a query: ours with Report::kCapsules, the others' with a closed-form "
    "test of two capsules in the callback, or with their own collide()."
)
# Below a row of whom it may mislead.
EMBREES_ORDERS = "Embree visits both orders of each pair of a scene that is asked for itself"
NOTES = {row: EMBREES_ORDERS for row in (ratios.EMBREE, ratios.EMBREE_2, ratios.EMBREE_TEST)}
NOTES[ratios.GRID] = "which counts pairs and hands none on"


WITH_BOXES = (
    ratios.UPDATE,
    ratios.SET_UP,
    ratios.SET_UP_WITH_BOXES,
    ratios.COAL_UPDATE,
    ratios.SET_UP_OF_COAL,
    ratios.COAL_TEST,
    ratios.COAL_COLLIDE,
)


def scenes_of(parts):
    """By name, those that were measured."""
    return {name: Scene(name, part) for name, part in chosen(parts, "frames").items()}


def ratio_cell(scene, row):
    ratio = scene.ratio(row)
    if ratio is None:
        return "-" if scene.has(ratios.ROWS[row].library) else "not installed"
    return ratio.text(row in WITH_BOXES)


def times_cell(scene, row):
    ratio, of = scene.ratio(row), ratios.ROWS[row]
    if ratio is None:
        return "-"
    theirs = scene.median(ratio.against, of.key)
    return f"{time(theirs)} / {time(scene.median(of.ours, of.our_key or of.key))}"


def row_title(scenes, row):
    """With the size of the sample, where the library's own test was not called on all pairs."""
    if row in NOTES:
        return f"{row} ({NOTES[row]})"
    of = ratios.ROWS[row] if row in ratios.ROWS else None
    if of is None or of.then != ratios.COLLIDE:
        return row
    found = [scene.sampled(of) for scene in scenes.values() if scene.ratio(row)]
    sizes = sorted(sampled for sampled, of in found if sampled < of)
    if not sizes:
        return row
    sizes = dict.fromkeys([count(sizes[0]), count(sizes[-1])])
    return f"{row} (estimated from {' to '.join(sizes)} pairs)"


def header_of(scenes, what=""):
    return [what, *(scene.title() for scene in scenes.values())]


def least_of(scenes, row):
    """The least ratio over the scenes, as a plain number; or why there is none."""
    found = [ratio for scene in scenes.values() if (ratio := scene.ratio(row))]
    if not found:
        return ratio_cell(next(iter(scenes.values())), row)
    least = min(found, key=lambda ratio: ratio.value)
    is_told = least.runs == 0 and least.high <= ratios.NOISY * least.low
    return digits(least.value, 2) if is_told else least.text()


IN_README = {
    ratios.TOUCHING_TEST: "FCL's fastest tree, closed-form test of capsules",
    ratios.TOUCHING_TIGHT: "FCL's fastest tree, `fcl::collide`, timed on a sample",
    ratios.COAL_TEST: "coal's fastest tree, closed-form test",
    ratios.EMBREE_TEST: "Embree's fastest tree, in both orders, closed-form test",
    ratios.GRID_TEST: "a uniform grid, closed-form test",
}


def readme(scenes):
    """Ten numbers at most, on two machines."""
    cells = {what: least_of(scenes, row) for row, what in IN_README.items()}
    caption = "How many times as fast ours is, the least of the scenes."
    return MainTable("readme", "How fast it is", cells, caption)


def headline(scenes):
    """The rows that say most; all_ratios() has the others."""
    rows = [
        ratios.TIGHT,
        ratios.UPDATE,
        *IN_README,
        ratios.COAL_COLLIDE,
        ratios.EMBREE,
        ratios.GRID,
    ]
    lines = [[row_title(scenes, r), *(ratio_cell(s, r) for s in scenes.values())] for r in rows]
    header, most = header_of(scenes, SPEED_UP), max(map(Scene.processes, scenes.values()))
    caption = READ_RATIOS
    if most > 1:
        caption += (
            f" Each scene was measured in {most} processes, each with the tree that was fastest in "
            "it. For the interval processes are drawn first, and then runs of each."
        )
    return Table("headline", "Headline", header, lines, caption)


def all_ratios(scenes):
    rows = Rows(scenes.values())
    for row in ratios.ROWS:
        rows.add(row_title(scenes, row), lambda scene: ratio_cell(scene, row))
    what = "Our update, in multiples of a loop that only reads"
    rows.add(what, lambda s: digits(s.times_the_floor(), 2) + "x")
    rows.add("Our bytes per segment, boxes", lambda s: digits(s.bytes(BOXES)))
    rows.add("Our bytes per segment, kCapsules", lambda s: digits(s.bytes(ratios.CAPSULES)))
    rows.add("Our bytes with boxes, as a share of FCL's", lambda s: digits(s.of_fcls_bytes(), 2))
    return Table("ratios", "Speed-up", header_of(scenes, SPEED_UP), rows, READ_RATIOS)


VARIANTS = {
    "debian": "as Debian builds FCL",
    "native": "all rebuilt with -O3 -march=native",
    "float": "both in float",
    "avx2": "ours held to AVX2",
    "sse4": "ours held to SSE4",
}


def at_their_best(parts):
    """FCL's, the grid's and our builds and scalars: two rows for each scene and row of ratios()."""
    rows = []
    found = {}
    for name, part in chosen(parts, "best").items():
        scene, variant = name.rsplit("_", 1)
        found.setdefault(scene, {})[variant] = Scene(scene, part)
    for name, scenes in found.items():
        for row in (ratios.TIGHT, ratios.UPDATE, ratios.TOUCHING_TEST, ratios.GRID_TEST):
            title = f"{next(iter(scenes.values())).title()}: {row}"
            for what, cell in ((title, ratio_cell), (f"{title}, time of both", times_cell)):
                cells = [cell(scenes[of], row) if of in scenes else "-" for of in VARIANTS]
                rows.append([what, *cells])
    header = [SPEED_UP, *VARIANTS.values()]
    return Table("best-builds", "FCL at its best", header, rows, ratios.READ)


def embrees(parts):
    """Versions of Embree: a row for each scene, version and way to follow a motion."""
    rows = []
    for name, part in chosen(parts, "embree").items():
        scene = Scene(name.rsplit("_", 1)[0], part)
        names = [name for name in scene.contenders if name.startswith("Embree")]
        for name in sorted(names, key=order_of):
            library = next(v for v in part.context["libraries"].split(", ") if "Embree" in v)
            what = title(name.removesuffix(ratios.TEST)).replace("Embree", library, 1)
            tested = name.endswith(ratios.TEST)
            runs = [scene.runs(tree, "frame") for tree in (name, CAPSULES if tested else BOXES)]
            row = [f"{scene.title()}: {what}", "touching" if tested else "of boxes"]
            rows.append([*row, *(time(one.median()) for one in runs), ratio_of(*runs).text()])
    header = ["update + detection, 1 thread", "pairs", "Embree", "ours", "times as fast"]
    caption = (
        f"{ratios.READ} {EMBREES_ORDERS}. The two versions ran in processes of their own, so "
        "compare ratios."
    )
    return Table("embree", "Versions of Embree", header, rows, caption)


def best(scenes):
    """Whom the ratios are against."""
    rows = Rows(scenes.values())
    for row in ratios.ROWS:
        if not row.endswith(ON_2_THREADS):

            def against(scene):
                ratio = scene.ratio(row)
                return title(ratio.against) if ratio else ratio_cell(scene, row)

            rows.add(row, against)
    for threads in (1, 2):
        what = f"Detection per visited pair: speed-up over Embree, {threads} thread"
        rows.add(what + "s" * (threads - 1), lambda scene: visited_ratio(scene, threads))
    caption = (
        "Whom each row compares with. Ours visits each pair once, Embree in both orders, and after "
        "a refit also pairs in two leaves whose boxes do not overlap."
    )
    return Table("best", "The fastest of the others", header_of(scenes), rows, caption)


def per_visited(scene, name):
    """Nanoseconds by run."""
    return 1e9 * scene.part.runs("Frames", name, "detection") / scene.median(name, "visited")


def visited_ratio(scene, threads):
    names = scene.of("Embree", threads=threads)
    if not names:
        return ratio_cell(scene, ratios.EMBREE)
    against = min(names, key=lambda name: per_visited(scene, name).median())
    ours = BOXES + "_2_threads" * (threads - 1)
    return ratio_of(per_visited(scene, against), per_visited(scene, ours), against).text()


def scene_table(scene):
    part, rows = scene.part, []
    for name in sorted(scene.contenders, key=order_of):
        cells = []
        for key in ("set_up", ratios.set_up_key(name), *PHASES[1:]):
            form = time_and_interval if key == "frame" else lambda runs: time(runs.median())
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
        "Times are medians, that of a frame with its 95 % interval. 'And test' is a "
        "closed-form test of two capsules in the callback. 'And collide' is the library's own "
        "collide(); its detection and ~ are scaled up from the sample, and how far ~ is from the "
        "count of 'and test' tells how good the sample is. Only FCL's managers read boxes "
        "that somebody has written. A tree of FCL's or coal's that was fastest in some phases "
        "alone, when all were tried, has only these."
    )
    if scene.name == "paper-dynamic":
        steps = count(scene.median(BOXES, "frames"))
        caption += f" Times and pairs are sums over {steps} steps."
        caption += " Touching pairs of rows with a test are such sums, too."
        caption += " Those of other rows are of the middle step."
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
        f"The least of three runs, on {segments:,.0f} segments. The fastest of each column was "
        "measured; in the last two columns, the fastest with either boxes."
    )
    return Table(
        f"tried {scene.name}",
        f"Levels of FCL's and coal's trees, {scene.title()}",
        ["", *PHASE_TITLES],
        rows,
        caption,
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
    caption = (
        "Helices of 100 segments at one density. Times are medians, and the last column is the "
        "quotient of two of them, which has no interval."
    )
    return Table("growth", "Growth", header, rows, caption)
