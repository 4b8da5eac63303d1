# SPDX-License-Identifier: BSD-3-Clause
"""The page's figures, each as an <img> with its picture inside."""

import base64
import io
import math

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.patches import Circle
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from results import read_csv

plt.rcParams.update(
    {
        "font.family": ["DejaVu Sans"],
        "font.size": 9.5,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.edgecolor": "#7b8494",
        "axes.labelcolor": "#1d2330",
        "axes.titlesize": 10.5,
        "axes.titlelocation": "left",
        "axes.titleweight": "bold",
        "xtick.color": "#5b6475",
        "ytick.color": "#5b6475",
        "axes.grid": True,
        "grid.color": "#e6e9ef",
        "grid.linewidth": 0.7,
        "legend.frameon": False,
        "svg.fonttype": "path",
        "svg.hashsalt": "fcl_fibers",
    }
)

# Ours in colour and full, FCL's in grey; okabe-ito colours, which most eyes tell apart.
SERIES = {
    "LayeredAABBTree/super_thread": ("boxes, as published", "#d55e00", "-", "o"),
    "WrappedSphereTree/super_thread": ("spheres, as published", "#9b3f8f", "-", "s"),
    "LayeredAABBTree/bundle": ("boxes, by default", "#0072b2", "-", "o"),
    "WrappedSphereTree/bundle": ("spheres, by default", "#009e73", "-", "s"),
    "LayeredAABBTree/bundle_capsules": ("boxes, by default, capsules out", "#56b4e9", "--", "D"),
    "DynamicAABBTree/tight": ("FCL dynamic AABB tree", "#22262e", "-", "^"),
    "DynamicAABBTree_Array/tight": ("FCL dynamic AABB tree, array", "#22262e", ":", "v"),
    "SaP/tight": ("FCL SaP", "#8d94a1", "-", "P"),
    "SSaP/tight": ("FCL SSaP", "#8d94a1", "--", "X"),
    "IntervalTree/tight": ("FCL interval tree", "#8d94a1", "-.", "<"),
    "SpatialHashing/tight": ("FCL spatial hashing", "#8d94a1", ":", ">"),
    "Naive/tight": ("FCL naive", "#c3c7cf", "-", "x"),
}

RED = "#e01b24"


def title_of(name):
    return SERIES[name][0]


def image(figure, alt, kind="svg", dpi=130):
    buffer = io.BytesIO()
    metadata = {"Date": None} if kind == "svg" else {}
    figure.savefig(buffer, format=kind, dpi=dpi, bbox_inches="tight", metadata=metadata)
    plt.close(figure)
    data = base64.b64encode(buffer.getvalue()).decode()
    mime = "image/svg+xml" if kind == "svg" else "image/png"
    return f'<img alt="{alt}" src="data:{mime};base64,{data}">'


def seconds_label(value, _=None):
    for unit, scale in (("s", 1), ("ms", 1e-3), ("µs", 1e-6)):
        if value >= scale * 0.9999:
            return f"{value / scale:g} {unit}"
    return f"{value:g} s"


def count_label(value, _=None):
    for unit, scale in (("M", 1e6), ("k", 1e3)):
        if value >= scale:
            return f"{value / scale:g}{unit}"
    return f"{value:g}"


def plot(axes, name, x, y, **changes):
    label, colour, line, marker = SERIES[name]
    ours = not label.startswith("FCL")
    style = {
        "color": colour,
        "linestyle": line,
        "marker": marker,
        "markersize": 4.5 if ours else 4,
        "linewidth": 1.8 if ours else 1.1,
        "label": label,
        "zorder": 3 if ours else 2,
    }
    style.update(changes)
    axes.plot(x, y, **style)


def legend_below(figure, axes_list, columns=4):
    found = {}
    for axes in axes_list:
        for handle, label in zip(*axes.get_legend_handles_labels()):
            found.setdefault(label, handle)
    figure.legend(
        found.values(),
        found.keys(),
        loc="upper center",
        bbox_to_anchor=(0.5, 0.0),
        ncol=columns,
        fontsize=8.8,
        handlelength=2.6,
    )


def log_log_seconds(axes, x_label):
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.xaxis.set_major_formatter(FuncFormatter(count_label))
    axes.yaxis.set_major_formatter(FuncFormatter(seconds_label))
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_xlabel(x_label)


def static_figure(static, phase, alt):
    """Figs. 7 to 9: log-log with all managers, and linear with the paper's two, as it drew them."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(10.4, 4.0), gridspec_kw={"wspace": 0.24})
    for name in SERIES:
        points = [
            (fibers * 0.1, part.entries[name].median(phase))
            for fibers, part in static.items()
            if name in part.entries and not math.isnan(part.entries[name].median(phase))
        ]
        if not points:
            continue
        x, y = np.array(points).T
        # The tree alone sets up and updates; capsules are tested in detection.
        if name == "LayeredAABBTree/bundle_capsules" and phase != "SelfCollision":
            continue
        plot(left, name, 1000 * x, y)
        if name.startswith(("Layered", "Wrapped")):
            plot(right, name, 1000 * x, y)
    log_log_seconds(left, "segments")
    left.set_title("all managers, logarithmic")
    right.set_title("ours, linear, as the paper draws it")
    right.set_xlabel("segments")
    right.set_xlim(left=0)
    right.set_ylim(bottom=0)
    right.xaxis.set_major_formatter(FuncFormatter(count_label))
    right.yaxis.set_major_formatter(FuncFormatter(lambda v, _: "0" if v == 0 else seconds_label(v)))
    legend_below(figure, [left, right])
    return image(figure, alt)


def step_series(entry, counter):
    """Values by step, NaN where there is none."""
    values = {}
    for key, value in entry.counters.items():
        name, _, step = key.partition(":")
        if name == counter:
            values[int(step)] = value
    if not values:
        return np.array([])
    return np.array([values.get(step, math.nan) for step in range(max(values) + 1)])


def dynamic_figure(part):
    figure, axes = plt.subplots(1, 3, figsize=(10.4, 3.9), gridspec_kw={"wspace": 0.34})
    collisions, detection, updates = axes
    for name in SERIES:
        entry = part.entries.get(name)
        if entry is None or not entry.counters:
            continue
        for panel, counter in ((detection, "detection"), (updates, "update")):
            y = step_series(entry, counter)
            if counter == "update" and name.endswith("capsules"):
                continue
            plot(panel, name, np.arange(len(y)), y, marker="", linewidth=1.5)
        if name in (
            "LayeredAABBTree/super_thread",
            "WrappedSphereTree/super_thread",
            "LayeredAABBTree/bundle_capsules",
        ):
            y = step_series(entry, "pairs")
            plot(collisions, name, np.arange(len(y)), y, marker="", linewidth=1.8)
    collisions.set_title("collisions: pairs reported")
    detection.set_title("detection")
    updates.set_title("update")
    collisions.yaxis.set_major_formatter(FuncFormatter(count_label))
    for panel in axes:
        panel.set_yscale("log")
        panel.set_xlabel("step")
    collisions.set_yscale("symlog", linthresh=10)
    for panel in (detection, updates):
        panel.yaxis.set_major_formatter(FuncFormatter(seconds_label))
        panel.yaxis.set_minor_formatter(NullFormatter())
    legend_below(figure, [detection])
    return image(figure, "Dynamic assembly: collisions, detection and update by step")


def cages_figure(part):
    figure, axes = plt.subplots(figsize=(6.4, 3.0))
    for name in ("WrappedSphereTree/super_thread", "WrappedSphereTree/bundle"):
        entry = part.entries.get(name)
        if entry is None:
            continue
        recomputed = step_series(entry, "cages_recomputed")
        kept = step_series(entry, "cages_kept")
        plot(axes, name, np.arange(len(kept)), 100 * recomputed / (recomputed + kept), marker="")
    axes.set_xlabel("step")
    axes.set_ylabel("cages recomputed, %")
    axes.set_ylim(bottom=0)
    legend_below(figure, [axes], columns=2)
    return image(figure, "Share of cages recomputed, by step")


def chain_figure(chains):
    """`chains`: by kind, parts by edge of the cube."""
    figure, axes = plt.subplots(1, 2, figsize=(10.4, 3.9), sharey=True, gridspec_kw={"wspace": 0.1})
    for panel, (kind, parts) in zip(axes, chains.items()):
        for name in list(SERIES)[:4]:
            points = [
                (e.counters["segments"], e.counters["volume_tests"])
                for part in parts.values()
                for e in [part.entries.get(name)]
                if e and e.counters.get("volume_tests")
            ]
            if points:
                x, y = np.array(points).T
                plot(panel, name, x, y)
        if parts:
            n = np.array([4e2, 3e5])
            panel.plot(n, 12 * n ** (4 / 3), color="#555", linewidth=1, linestyle=(0, (5, 4)))
            panel.text(n[0] * 2.2, 12 * (2.2 * n[0]) ** (4 / 3) * 0.5, r"$n^{4/3}$", color="#555")
            panel.plot(n, 12 * n, color="#999", linewidth=1, linestyle=(0, (1, 2)))
            panel.text(n[1] * 0.55, 12 * n[1] * 0.3, r"$n$", color="#777")
        panel.set_xscale("log")
        panel.set_yscale("log")
        panel.set_xlabel("segments n")
        panel.xaxis.set_major_formatter(FuncFormatter(count_label))
        panel.yaxis.set_major_formatter(FuncFormatter(count_label))
        panel.set_title({"random": "random path", "snake": "snake"}[kind])
    axes[0].set_ylabel("tests of two volumes")
    legend_below(figure, axes)
    return image(figure, "Volume tests against the number of segments of one chain")


def radii_figure(rows):
    figure, axes = plt.subplots(figsize=(6.4, 3.4))
    kinds = {
        "straight": ("straight chain", "#8d94a1", "^"),
        "random": ("random path", "#0072b2", "o"),
        "snake": ("snake", "#009e73", "s"),
        "static": ("static assembly", "#d55e00", "D"),
        "strand": ("strand", "#9b3f8f", "v"),
    }
    for kind, (label, colour, marker) in kinds.items():
        points = sorted(
            (r["height"], r["layered"] / r["wrapped"])
            for n, r in rows.items()
            if n.startswith(kind)
        )
        if points:
            x, y = np.array(points).T
            axes.plot(x, y, color=colour, marker=marker, markersize=5, linewidth=1.4, label=label)
    h = np.linspace(2, 18, 60)
    axes.plot(
        h, np.sqrt(h + 1), color="#1d2330", linewidth=1.4, linestyle="--", label=r"$\sqrt{h+1}$"
    )
    axes.set_xlabel("height h of the tree")
    axes.set_ylabel("layered : wrapped")
    axes.set_ylim(0.9, None)
    legend_below(figure, [axes], columns=3)
    return image(figure, "Ratio of the roots' radii against the height of the tree")


# Pictures


def view_matrix(azimuth, elevation):
    """Rows: right, up, towards the viewer; z is up."""
    a, e = math.radians(azimuth), math.radians(elevation)
    towards = np.array([math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)])
    right = np.array([-math.sin(a), math.cos(a), 0.0])
    return np.stack([right, np.cross(towards, right), towards])


def principal_view(points):
    """The longest direction up, the shortest towards the viewer."""
    sample = points[:: max(1, len(points) // 20000)]
    _, _, axes = np.linalg.svd(sample - sample.mean(axis=0), full_matrices=False)
    right, up = axes[1], axes[0]
    if up[2] > 0:  # roots, which come first, on top
        up = -up
    first = (points[0] - points.mean(axis=0)) @ up
    if first < 0:
        up = -up
    return np.stack([right, up, np.cross(right, up)])


class Picture:
    def __init__(self, folder, name):
        self.counts = {k: float(v) for k, v in read_csv(folder / f"{name}.csv")[0].items()}
        self.points = np.fromfile(folder / f"{name}.points", dtype=np.float32).reshape(-1, 3)
        self.begin = np.fromfile(folder / f"{name}.begin", dtype=np.int32)
        self.touching = np.fromfile(folder / f"{name}.touching", dtype=np.uint8).astype(bool)

    def segments(self):
        """End points of all segments, and their fibers."""
        starts = np.ones(len(self.points), dtype=bool)
        starts[self.begin[1:] - 1] = False
        first = np.flatnonzero(starts)
        fiber = np.repeat(np.arange(len(self.begin) - 1), np.diff(self.begin) - 1)
        return self.points[first], self.points[first + 1], fiber


def hair_colours(fiber, depth, rng_seed=5):
    """A tone for each fiber, darker behind."""
    tones = np.random.default_rng(rng_seed).uniform(-0.09, 0.09, fiber.max() + 1)
    low, high = np.percentile(depth, [2, 98])
    shade = np.clip((depth - low) / max(high - low, 1e-9), 0, 1)
    base = np.array([0.56, 0.41, 0.26])
    light = 0.55 + 0.6 * shade + tones[fiber]
    return np.clip(base * light[:, None], 0, 1)


def draw_fibers(axes, picture, view, width, keep=None, red=True, window=None, dots=0):
    """`dots`: of this size on touching segments that are too short to be seen."""
    a, b, fiber = picture.segments()
    touching = picture.touching
    if keep is not None:
        chosen = keep(fiber)
        a, b, fiber, touching = a[chosen], b[chosen], fiber[chosen], touching[chosen]
    pa, pb = a @ view.T, b @ view.T
    if window is not None:
        (x0, x1), (y0, y1) = window
        inside = (pa[:, 0] > x0) & (pa[:, 0] < x1) & (pa[:, 1] > y0) & (pa[:, 1] < y1)
        pa, pb, fiber, touching = pa[inside], pb[inside], fiber[inside], touching[inside]
    depth = (pa[:, 2] + pb[:, 2]) / 2
    colours = hair_colours(fiber, depth)
    widths = np.full(len(depth), width)
    if red:
        colours[touching] = matplotlib.colors.to_rgb(RED)
        widths[touching] = 1.6 * width
    order = np.argsort(depth)
    lines = np.stack([pa[order, :2], pb[order, :2]], axis=1)
    axes.add_collection(
        LineCollection(lines, colors=colours[order], linewidths=widths[order], capstyle="round")
    )
    if red and dots:
        middle = (pa[touching, :2] + pb[touching, :2]) / 2
        axes.scatter(*middle.T, s=dots, color=RED, linewidths=0, zorder=3)
    axes.set_aspect("equal")
    if window is None:
        axes.autoscale_view()
    else:
        axes.set_xlim(*window[0])
        axes.set_ylim(*window[1])
    axes.axis("off")


def thin(step):
    """Long fibers with fine segments need not be drawn segment by segment."""

    def apply(picture):
        kept_points, kept_begin, kept_touching = [], [0], []
        segment_begin = picture.begin - np.arange(len(picture.begin))
        for f in range(len(picture.begin) - 1):
            points = picture.points[picture.begin[f] : picture.begin[f + 1]]
            touching = picture.touching[segment_begin[f] : segment_begin[f + 1]]
            index = np.unique(np.append(np.arange(0, len(points), step), len(points) - 1))
            kept_points.append(points[index])
            kept_begin.append(kept_begin[-1] + len(index))
            kept_touching.append(np.logical_or.reduceat(touching, index[:-1]))
        result = object.__new__(Picture)
        result.counts = picture.counts
        result.points = np.concatenate(kept_points)
        result.begin = np.array(kept_begin, dtype=np.int32)
        result.touching = np.concatenate(kept_touching)
        return result

    return apply


def strand_picture(folder):
    full = Picture(folder, "strand")
    view = principal_view(full.points)
    picture = thin(8)(full)
    figure, (left, right, detail) = plt.subplots(
        1, 3, figsize=(10.4, 6.4), gridspec_kw={"width_ratios": [1, 1, 1.5], "wspace": 0.05}
    )
    draw_fibers(left, picture, view, 0.35, red=False)
    draw_fibers(right, picture, view, 0.35, dots=1.2)
    projected = full.points @ view.T
    centre = np.median(projected[np.arange(len(projected)) % 2001 == 1700], axis=0)
    half = 0.06 * np.ptp(projected[:, 1])
    window = (
        (centre[0] - 0.8 * half, centre[0] + 0.8 * half),
        (centre[1] - 1.2 * half, centre[1] + 1.2 * half),
    )
    draw_fibers(detail, full, view, 0.8, window=window, dots=8)
    for axes in (left, right):
        axes.set_xlim(*window_of(projected, 0))
        axes.set_ylim(*window_of(projected, 1))
    x, y = window
    right.plot(
        [x[0], x[1], x[1], x[0], x[0]],
        [y[0], y[0], y[1], y[1], y[0]],
        color="#1d2330",
        linewidth=0.9,
    )
    return image(figure, "The strand", "png", 125), picture.counts


def window_of(projected, axis):
    low, high = projected[:, axis].min(), projected[:, axis].max()
    margin = 0.03 * (high - low)
    return low - margin, high + margin


def loop_picture(folder):
    picture = Picture(folder, "loop")
    view = principal_view(picture.points)
    figure, axes = plt.subplots(figsize=(6.0, 5.0))
    draw_fibers(axes, picture, view, 0.6)
    return image(figure, "The dynamic assembly bent to a loop", "png", 140), picture.counts


def half_scalp_picture(folder):
    picture = Picture(folder, "half_scalp")
    figure, (left, right) = plt.subplots(1, 2, figsize=(10.4, 5.2), gridspec_kw={"wspace": 0.02})
    rng = np.random.default_rng(3).random(len(picture.begin))
    for axes, azimuth, red in ((left, 60, False), (right, 60, True)):
        draw_fibers(axes, picture, view_matrix(azimuth, 12), 0.22, lambda f: rng[f] < 0.3, red=red)
    return image(figure, "The half scalp", "png", 120), picture.counts


def box_outline(row, view):
    """The convex outline of a projected box."""
    low, high = np.array(row[:3]), np.array(row[3:6])
    corners = np.array([[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)]) @ view.T
    return corners


BOX_EDGES = [(i, i | 1 << k) for i in range(8) for k in range(3) if not i >> k & 1]


def volumes_picture(folder, depth=3):
    """One filament in the volumes of one depth; child cages that stick out, and their parents."""
    rows = [
        (
            r["kind"],
            int(r["depth"]),
            int(r["node"]),
            int(r["parent"]),
            [float(r[c]) for c in "abcdef"],
        )
        for r in read_csv(folder / "volumes.csv")
    ]
    fiber = np.array([[float(p[c]) for c in "xyz"] for p in read_csv(folder / "volumes_fiber.csv")])
    view = principal_view(fiber)
    tilt = np.array([[1, 0, 0], [0, 0.94, 0.34], [0, -0.34, 0.94]])
    box_view = tilt @ view
    colours = plt.get_cmap("tab10").colors
    figure, (left, middle, right) = plt.subplots(
        1, 3, figsize=(10.4, 3.9), gridspec_kw={"wspace": 0.04}
    )

    line = fiber @ box_view.T
    left.plot(line[:, 0], line[:, 1], color="#1d2330", linewidth=1.6, zorder=5)
    boxes = [r for r in rows if r[0] == "box" and r[1] == depth]
    for i, (_, _, _, _, numbers) in enumerate(boxes):
        corners = box_outline(numbers, box_view)
        left.add_collection(
            LineCollection(
                [corners[[p, q], :2] for p, q in BOX_EDGES],
                colors=[colours[i % 10]],
                linewidths=1.2,
            )
        )
    left.set_title(f"boxes at depth {depth}")

    line = fiber @ view.T
    middle.plot(line[:, 0], line[:, 1], color="#1d2330", linewidth=1.6, zorder=5)
    right.plot(line[:, 0], line[:, 1], color="#8d94a1", linewidth=1.0)
    spheres = [r for r in rows if r[0] == "sphere"]

    def circle(numbers, **style):
        centre = np.array(numbers[:3]) @ view.T
        return Circle(centre[:2], numbers[3], **style)

    for i, (_, _, _, _, numbers) in enumerate(r for r in spheres if r[1] == depth):
        colour = colours[i % 10]
        middle.add_patch(
            circle(numbers, facecolor=(*colour, 0.12), edgecolor=colour, linewidth=1.2)
        )
    middle.set_title(f"wrapped spheres at depth {depth}")

    stick_out = most_sticking_out(spheres, depth)
    if stick_out is not None:
        parent, children, excess = stick_out
        right.add_patch(
            circle(parent[4], facecolor="none", edgecolor="#1d2330", linewidth=1.8, zorder=6)
        )
        for child, colour in zip(children, ("#0072b2", "#d55e00")):
            rgb = matplotlib.colors.to_rgb(colour)
            right.add_patch(
                circle(child[4], facecolor=(*rgb, 0.13), edgecolor=colour, linewidth=1.4)
            )
        right.set_title(f"a cage and its children, {100 * excess:.0f} % outside")
    for panel in (left, middle, right):
        panel.set_aspect("equal")
        panel.autoscale_view()
        panel.axis("off")
    share_limits((left, middle, right))
    return image(figure, "Boxes and wrapped spheres of one filament"), stick_out


def share_limits(panels):
    """One scale for all, each about its own middle."""
    half = [
        max(np.ptp(limits(p)) for p in panels) / 2
        for limits in (plt.Axes.get_xlim, plt.Axes.get_ylim)
    ]
    for panel in panels:
        x, y = np.mean(panel.get_xlim()), np.mean(panel.get_ylim())
        panel.set_xlim(x - half[0], x + half[0])
        panel.set_ylim(y - half[1], y + half[1])


def most_sticking_out(spheres, depth):
    """The parent whose child reaches out farthest, in parts of the parent's radius."""
    by_node = {r[2]: r for r in spheres}
    best = None
    for row in spheres:
        parent = by_node.get(row[3])
        if parent is None or row[1] > depth + 1:
            continue
        gap = np.linalg.norm(np.array(row[4][:3]) - np.array(parent[4][:3]))
        excess = (gap + row[4][3]) / parent[4][3] - 1
        if best is None or excess > best[2]:
            best = (parent, [r for r in spheres if r[3] == parent[2]], excess)
    return best
