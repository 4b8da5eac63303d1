# SPDX-License-Identifier: BSD-3-Clause
"""Table I and the curves of the set paper: what the paper measured, once more."""

import numpy as np

from paper_pictures import FCL_TREE, Panel, label_of, panels_figure
from pictures import OURS, count_label, seconds_label
from ratios import FCL
from tables import Table, count, time

# Table I and section 4.1 of the paper, Pentium IV 2.4 GHz: seconds by phase, and collisions.
PAPER = {
    "half-scalp": {
        "wrapped spheres": (4.609, 1924.74, 1984.78, 550_000),
        "boxes": (4.109, 0.766, 100.531, 550_000),
    },
    "strand_1000": {
        "wrapped spheres": (2.907, 91.923, 15.282, 23_000),
        "boxes": (2.781, 0.281, 1.688, 23_000),
    },
    "strand_2000": {"boxes": (None, 0.6, 4.3, 80_000)},
}
TABLE_SCENES = {
    "half-scalp": "paper-half-scalp 50,000 x 50",
    "strand_1000": "paper-strand 1,000 x 2,000",
    "strand_2000": "paper-strand 2,000 x 2,000",
    "frames_hair": "hair",
}
PHASES = ("set_up", "update", "detection")
PHASE_TITLES = ["construction", "update", "detection"]
STATIC = (
    "Static assembly of 100 segments per fiber, turned. Boxes and spheres report volumes that "
    "overlap. 'kCapsules' reports capsules that touch."
)
REPLAY = (
    "150 fibers of 100 segments bend from straight to a loop in 100 steps. Each manager lives "
    "through all of them. A step's time is the least over the replays."
)
CAGES = "Share of cages that were recomputed. The trees are built once."
CHAINS = (
    "Both chains visit each point of a cubic lattice once, in random order or row after row. The "
    "lattice is turned by 45 degrees about two axes."
)
RADII = (
    "Radii of the roots. The last column is the largest ratio of a node's two radii, divided by "
    "sqrt(h + 1)."
)
RODS = "Warm starts from the shape under a load that differs by 2 %. Cold has no starting shape."
VIEW = "Touching segments are red. Some fibers and points are left out; contacts are of all."
AXES = {"axis_turned_0": "all but straight, along z,", "axis_turned_1": "all but straight, turned,"}
PUBLISHED = ("LayeredAABBTree/super_thread", "WrappedSphereTree/super_thread")


def numbered(parts, prefix):
    """Parts `prefix_N`, by N, ascending."""
    numbers = (name[len(prefix) + 1 :] for name in parts if name.startswith(prefix + "_"))
    return {n: parts[f"{prefix}_{n}"] for n in sorted(int(n) for n in numbers if n.isdigit())}


def fcl_names(part, kind, managers=tuple(FCL)):
    return [name for name in part.names(kind) if name.split("/")[0] in managers]


def rows_of(parts):
    """Contenders of one row by its title: ours one by one, FCL's trees as one."""
    ours = [name for name in OURS if any(part.has("Checked", name) for part in parts)]
    rows = {label_of(name): [name] for name in ours}
    rows["FCL's best tree, tight boxes"] = [
        name for part in parts for name in fcl_names(part, "Checked", FCL_TREE)
    ]
    return rows


def row_cells(parts, names):
    """A phase's least median, or its single time of the check, or why there is none."""
    cells, ended = [], False
    for phase in PHASES:
        there = [(p, n) for p in parts for n in names if p.has("Frames", n)]
        timed = [p.median("Frames", n, phase) for p, n in there if p.knows("Frames", n, phase)]
        checks = [p.counters("Checked", n) for p in parts for n in names if p.has("Checked", n)]
        once = [check[phase].iloc[0] for check in checks if phase in check]
        once = [seconds for seconds in once if seconds > 0]  # NaN: not reached
        if timed or once:
            cells.append(time(min(timed)) if timed else "~" + time(min(once)))
        else:
            cells.append("-" if ended else checks[0]["label"].iloc[0])
            ended = True
    counts = []
    for key in ("pairs", "touching"):
        known = [check[key].iloc[0] for check in checks if not check["label"].iloc[0]]
        counts.append(count(known[0]) if known else "-")
    return cells + counts


def table_one(parts):
    rows = []
    for scene in [scene for scene in TABLE_SCENES if scene in parts]:
        title = parts[scene].title(TABLE_SCENES[scene])
        for volume, (*seconds, collisions) in PAPER.get(scene, {}).items():
            cells = ["-" if value is None else time(value) for value in seconds]
            rows.append([f"{title}: the paper's {volume}", *cells, count(collisions), "-"])
        slow = [part for name, part in parts.items() if name.startswith(scene + "_long_")]
        found = [parts[scene], *slow]
        for row, names in rows_of(found).items():
            rows.append([f"{title}: {row}", *row_cells(found, names)])
    caption = (
        "The paper's times are of a Pentium IV, 2.4 GHz, the others of one thread here. Rows with "
        "'super thread' are of the paper's tree, our other rows of the bundle. ~ marks a single "
        "time, > a phase that was ended. FCL's best is the tree and level that is fastest in the "
        "phase. Only FCL includes adjacent segments. The paper's collisions stand under pairs."
    )
    header = ["", *PHASE_TITLES, "pairs", "touching"]
    return Table("table-1", "Table I", header, rows, caption)


def fastest(part, kind, key):
    """By label: ours, and each manager of FCL at the level that is fastest."""
    ours = [name for name in part.names(kind) if name in OURS and part.knows(kind, name, key)]
    names = {label_of(name): name for name in ours}
    for manager, label in FCL.items():
        found = [n for n in fcl_names(part, kind, (manager,)) if part.knows(kind, n, key)]
        if found:
            names[label] = min(found, key=lambda name: part.median(kind, name, key))
    return names


def static_figure(parts, phase):
    """Figs. 7 to 9: logarithmic with all managers, and linear with ours, as the paper draws it."""
    curves = {}
    for part in numbered(parts, "static").values():
        segments = part.median("Checked", part.names("Checked")[0], "segments")
        for label, name in fastest(part, "Frames", phase).items():
            if phase == "detection" or "kCapsules" not in label:
                point = (segments, part.median("Frames", name, phase))
                curves.setdefault(label, []).append(point)
    ours = {label: points for label, points in curves.items() if not label.startswith("FCL")}
    form = {"xlabel": "segments", "x_format": count_label, "y_format": seconds_label}
    return panels_figure(
        [
            Panel("all managers, logarithmic", curves, xscale="log", yscale="log", **form),
            Panel("ours, linear", ours, **form),
        ]
    )


def static_caption(parts):
    """With who was ended, and from how many segments on."""
    ended = {}
    for part in numbered(parts, "static").values():
        for name in filter(part.note, part.names("Checked")):
            who = f"{label_of(name)} ({part.note(name)})"
            ended.setdefault(who, part.median("Checked", name, "segments"))
    texts = [f"{who} from {segments:,.0f} segments" for who, segments in ended.items()]
    return STATIC + (f" Not timed: {'; '.join(texts)}." if texts else "")


def steps(part, name, counter):
    """(step, value): the least time of the replays, which other programs disturbed least."""
    counters = part.counters("Replay", name)
    found = sorted(column for column in counters if column.startswith(counter + ":"))
    if not found:
        raise KeyError(f"{part.file}: Replay/{name} has no {counter}")
    return [(int(column.split(":")[1]), counters[column].min()) for column in found]


def replay_figure(part):
    names = fastest(part, "Replay", "seconds")
    pairs = [*map(label_of, PUBLISHED), label_of("LayeredAABBTree/capsules")]
    panels = []
    for title, counter, form in (
        ("pairs reported", "pairs", count_label),
        ("detection", "detection", seconds_label),
        ("update", "update", seconds_label),
    ):
        curves = {
            label: steps(part, name, counter)
            for label, name in names.items()
            if (counter != "pairs" or label in pairs)
            and (counter != "update" or "kCapsules" not in label)
        }
        scale = "symlog" if counter == "pairs" else "log"
        panels.append(Panel(title, curves, "step", yscale=scale, y_format=form, marker=""))
    return panels_figure(panels)


def cages_figure(part):
    curves = {}
    for name in ("WrappedSphereTree/super_thread", "WrappedSphereTree/spheres"):
        made, kept = (steps(part, name, "cages_" + what) for what in ("recomputed", "kept"))
        curves[label_of(name)] = [(s, 100 * m / (m + k)) for (s, m), (_, k) in zip(made, kept)]
    return panels_figure([Panel("cages recomputed, %", curves, "step", marker="")])


def chain_figure(parts):
    panels = []
    for kind in ("random", "snake"):
        curves = {}
        for part in numbered(parts, "chain_" + kind).values():
            for name in [name for name in part.names("Chain") if name in OURS]:
                point = part.medians("Chain", name, "segments", "volume_tests")
                curves.setdefault(label_of(name), []).append(point)
        n = np.array([4e2, 3e5])
        curves["n^(4/3)"] = list(zip(n, 12 * n ** (4 / 3)))
        curves["n"] = list(zip(n, 12 * n))
        form = {"xscale": "log", "yscale": "log", "x_format": count_label, "y_format": count_label}
        panels.append(Panel(f"{kind} path: tests of two volumes", curves, "segments n", **form))
    return panels_figure(panels)


def medians(part, kind, title, columns, caption=""):
    """`columns`: how a counter is written, by the counter."""
    names = sorted(part.names(kind), key=lambda name: (name.split(":")[0], len(name), name))
    rows = [[n, *(form(part.median(kind, n, key)) for key, form in columns.items())] for n in names]
    header = ["", *(key.replace("_", " ") for key in columns)]
    return Table(kind.lower(), title, header, rows, caption)
