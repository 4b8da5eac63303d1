# SPDX-License-Identifier: BSD-3-Clause
"""The curves of the set paper: what the paper measured, once more. Table I: paper_table.py."""

import numpy as np

from paper_pictures import Panel, label_of, panels_figure
from paper_table import PHASE_TITLES, PHASES, PUBLISHED, is_known
from pictures import OURS, count_label, seconds_label
from ratios import FCL
from results import TOO_SLOW
from tables import Table, count, time

STATIC = (
    "Static assembly of 100 segments per fiber, turned. Boxes and spheres report volumes that "
    "overlap. 'kCapsules' reports capsules that touch. SaP finds its pairs in its update."
)
REPLAY = (
    "150 fibers of 100 segments bend from straight to a loop in 100 steps. Each manager lives "
    "through all of them. A step's time is the median of the replays. SaP finds its pairs in its "
    "update."
)
CAGES = "Share of cages that were recomputed. The trees are built once."
TREES = "The boxes of eight nodes over the same six fibers."
VIEW = "Touching segments are red. Some fibers and points are left out; contacts are of all."
AXES = {"axis_turned_0": "all but straight, along z,", "axis_turned_1": "all but straight, turned,"}


def numbered(parts, prefix):
    """Parts `prefix_N`, by N, ascending."""
    numbers = (name[len(prefix) + 1 :] for name in parts if name.startswith(prefix + "_"))
    return {n: parts[f"{prefix}_{n}"] for n in sorted(int(n) for n in numbers if n.isdigit())}


def fcl_names(part, kind, managers=tuple(FCL)):
    return [name for name in part.names(kind) if name.split("/")[0] in managers]


def fastest(part, kind, key):
    """By label: ours, and each manager of FCL in the form and at the level that is fastest."""
    ours = [name for name in part.names(kind) if name in OURS and part.knows(kind, name, key)]
    names = {label_of(name): name for name in ours}
    found = {}
    for name in fcl_names(part, kind):
        if part.knows(kind, name, key):
            found.setdefault(label_of(name), []).append(name)
    for label, of in found.items():
        names[label] = min(of, key=lambda name: part.median(kind, name, key))
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


def static_table(parts):
    """Figs. 7 to 9 in numbers: each manager at its fastest level."""
    sizes = numbered(parts, "static")
    names = {}  # by label
    for part in sizes.values():
        for name in part.names("Checked"):
            names.setdefault(label_of(name), {})[name] = None

    def cell(part, of, phase):
        for kind, mark in (("Frames", ""), ("Checked", "~")):
            known = [name for name in of if part.has(kind, name)]
            if kind == "Checked":  # Who is wrong or has crashed has no time.
                known = [name for name in known if (part.note(name) or TOO_SLOW)[0] == TOO_SLOW]
            known = [name for name in known if is_known(part.counters(kind, name), phase)]
            if known:
                return mark + time(min(part.median(kind, name, phase) for name in known))
        notes = [part.note(name) for name in of if part.has("Checked", name)]
        return (notes or ["-"])[-1].split(":")[0]

    rows = [
        [f"{what}: {label}", *(cell(part, of, phase) for part in sizes.values())]
        for phase, what in zip(PHASES, PHASE_TITLES)
        for label, of in sorted(
            names.items(), key=lambda item: (item[0].startswith("FCL"), item[0])
        )
        if phase == "detection" or "kCapsules" not in label
    ]
    segments = [
        part.median("Checked", part.names("Checked")[0], "segments") for part in sizes.values()
    ]
    caption = (
        "Columns are numbers of segments. ~ marks a single time, of a manager that was too slow "
        "to be timed again, or is not the fastest of its kind."
    )
    return Table(
        "paper-static", "Figs. 7 to 9 in numbers", ["", *map(count, segments)], rows, caption
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
    """(step, value): the median of the replays."""
    counters = part.counters("Replay", name)
    found = sorted(column for column in counters if column.startswith(counter + ":"))
    if not found:
        raise KeyError(f"{part.file}: Replay/{name} has no {counter}")
    return [(int(column.split(":")[1]), counters[column].median()) for column in found]


def replay_figure(part):
    names = fastest(part, "Replay", "seconds")
    pairs = [*map(label_of, PUBLISHED.values()), label_of("LayeredAABBTree/capsules")]
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


def replay_table(part):
    """Fig. 10 in numbers."""
    rows = []
    for label, name in fastest(part, "Replay", "seconds").items():
        cells = []
        for counter, form in (("detection", time), ("update", time), ("pairs", count)):
            values = np.array(steps(part, name, counter))[:, 1]
            cells.append(
                " / ".join(form(x) for x in (values.min(), np.median(values), values.max()))
            )
        rows.append([label, *cells])
    header = ["least / median / greatest of a step", "detection", "update", "pairs reported"]
    return Table("paper-replay", "Fig. 10 in numbers", header, rows, REPLAY)


def cages_figure(part):
    curves = {}
    for name in ("WrappedSphereTree/super_thread", "WrappedSphereTree/spheres"):
        made, kept = (steps(part, name, "cages_" + what) for what in ("recomputed", "kept"))
        curves[label_of(name)] = [(s, 100 * m / (m + k)) for (s, m), (_, k) in zip(made, kept)]
    return panels_figure([Panel("cages recomputed, %", curves, "step", marker="")])
