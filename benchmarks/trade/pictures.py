# SPDX-License-Identifier: BSD-3-Clause
"""The page's figures: managers, and dials."""

import math

import matplotlib.pyplot as plt
from figures import RED, count_label, image, seconds_label
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from matplotlib.transforms import Bbox
from settings import FCL, OURS, SCENES, pareto, points_of, scenes_with

LEAST = 0.01  # false pairs per contact that the axis shows; exact ones stand below
COLOURS = {
    "static": ("#0072b2", "o"),
    "strand": ("#d55e00", "s"),
    "half_scalp": ("#009e73", "D"),
    "dynamic": ("#9b3f8f", "^"),
    "hair": ("#b07d00", "v"),
}
CROWDED = 0.5  # of a label's area: it is left out if more of it would cover others
NONE_BAND = "#eef4fb"
SOFT = "#5b6475"
# Where a label may stand about its point, best first: points of the page, and how it is aligned.
PLACES = [
    (far * dx, far * dy, ha, va)
    for far in (1, 1.9, 3)
    for dx, dy, ha, va in (
        (0, 5, "center", "bottom"),
        (0, -5, "center", "top"),
        (6, 0, "left", "center"),
        (-6, 0, "right", "center"),
        (5, 4, "left", "bottom"),
        (-5, 4, "right", "bottom"),
        (5, -4, "left", "top"),
        (-5, -4, "right", "top"),
    )
]


def time_axis(ax, seconds):
    """Logarithmic, unless all are of one order."""
    narrow = max(seconds) < 4 * min(seconds)
    if narrow:
        ax.xaxis.set_major_locator(MaxNLocator(6, steps=(1, 2, 5, 10)))
    else:
        ax.set_xscale("log")
        wide = max(seconds) > 200 * min(seconds)
        ax.xaxis.set_major_locator(LogLocator(subs=(1,) if wide else (1, 2, 5)))
        ax.xaxis.set_minor_formatter(NullFormatter())
    ax.xaxis.set_major_formatter(FuncFormatter(seconds_label))
    ax.margins(x=0.1, y=0.08)


def none_band(ax, least):
    """The foot of a logarithmic axis: nothing of what it shows."""
    ax.set_ylim(bottom=0.55 * least)
    ax.axhspan(0.55 * least, 1.8 * least, color=NONE_BAND, zorder=0)
    ax.text(0.01, 0.015, "none", transform=ax.transAxes, color=SOFT, size=8)
    ax.yaxis.set_major_locator(AboveBand(1.8 * least))


def managers_figure(parts):
    scenes = scenes_with(parts, "managers")
    columns = 2
    rows = (len(scenes) + 1 + columns - 1) // columns
    fig, axes = plt.subplots(rows, columns, figsize=(10.5, 3.6 * rows), squeeze=False)
    cells = list(axes.flat)
    for scene, ax in zip(scenes, cells):
        points = points_of(parts[f"managers_{scene}"])
        front = pareto(points)
        ax.plot(
            [p[1] for p in front],
            [max(p[2], LEAST) for p in front],
            color=RED,
            lw=1.2,
            drawstyle="steps-post",
            zorder=1,
        )
        for name, seconds, false in points:
            if name in OURS:
                _, color, marker = OURS[name]
            else:
                marker = FCL[name.split("/")[0]][1]
                color = "#22262e" if name.endswith("tight") else "#a3aab7"
            ax.scatter(seconds, max(false, LEAST), c=color, marker=marker, s=42, zorder=2)
        ax.set_yscale("log")
        ax.yaxis.set_major_formatter(FuncFormatter(count_label))
        if points:
            time_axis(ax, [p[1] for p in points])
        ax.set_title(SCENES[scene])
        ax.set_xlabel("a frame: motion, update, detection")
        ax.set_ylabel("false pairs per contact")
        none_band(ax, LEAST)
    legend = cells[len(scenes)]
    legend.axis("off")
    handles = [
        plt.Line2D([], [], color=color, marker=marker, ls="", label=label)
        for label, color, marker in OURS.values()
    ]
    handles += [
        plt.Line2D([], [], color="#22262e", marker=marker, ls="", label=label)
        for label, marker in FCL.values()
    ]
    handles += [
        plt.Line2D([], [], color="#a3aab7", marker="o", ls="", label="grey: stock boxes"),
        plt.Line2D([], [], color=RED, label="Pareto front"),
    ]
    legend.legend(handles=handles, loc="center", ncol=2, fontsize=8.5)
    for ax in cells[len(scenes) + 1 :]:
        ax.axis("off")
    fig.tight_layout()
    return image(fig, "False pairs against time, one picture a scene")


def dials_figure(dials):
    columns = 2
    cells = sum(columns if dial.wide else 1 for dial in dials) + 1  # and the legend
    rows = (cells + columns - 1) // columns
    fig = plt.figure(figsize=(10.5, 3.9 * rows))
    grid = fig.add_gridspec(rows, columns)
    at, labels = 0, []
    for dial in sorted(dials, key=lambda dial: not dial.wide):
        width = columns if dial.wide else 1
        ax = fig.add_subplot(grid[at // columns, at % columns : at % columns + width])
        labels.append((ax, *draw_dial(ax, dial)))
        at += width
    legend = fig.add_subplot(grid[at // columns, at % columns])
    legend.axis("off")
    legend.legend(handles=dials_legend(dials), loc="center", fontsize=9)
    fig.tight_layout()
    fig.draw_without_rendering()  # labels are placed where everything else stands
    for ax, points, lines in labels:
        place_labels(ax, points, lines)
    return image(fig, "What each dial trades, against time, one picture a dial")


def dials_legend(dials):
    scenes = {curve.scene for dial in dials for curve in dial.curves}
    handles = [
        plt.Line2D([], [], color=COLOURS[scene][0], marker=COLOURS[scene][1], ms=5.5, label=title)
        for scene, title in SCENES.items()
        if scene in scenes
    ]
    faces = ((SOFT, "full: on the Pareto front of its scene"), ("white", "hollow: not on it"))
    return handles + [
        plt.Line2D([], [], ls="", marker="o", ms=5.5, mec=SOFT, mfc=face, label=label)
        for face, label in faces
    ]


def draw_dial(ax, dial):
    """Returns the labels to be placed, (x, y, text, colour), and the lines to be kept free."""
    values = [p[2] for curve in dial.curves for p in curve.points]
    positive = [value for value in values if value > 0]
    least = 0.3 * min(positive) if positive else LEAST
    shown = (lambda value: max(value, least)) if dial.log else (lambda value: value)
    labels, lines = [], []
    for curve in dial.curves:
        colour, marker = COLOURS[curve.scene]
        front = dial.front(curve.scene)
        line = [(seconds, shown(value)) for _, seconds, value in curve.points]
        lines.append(line)
        dashed = curve.kind in ("radii", "margin")
        ax.plot(*zip(*line), color=colour, lw=1.1, ls="--" if dashed else "-", zorder=2)
        for point, at in zip(curve.points, line):
            best = point in front
            face = colour if best else "white"
            ax.plot(*at, marker=marker, ms=5.5, mec=colour, mfc=face, mew=1.1, zorder=3)
            labels.append((best, *at, point[0], colour))
    ax.set_title(dial.title)
    ax.set_ylabel(dial.trades)
    ax.set_xlabel(f"{dial.time}\nlabels: {dial.labels}")
    time_axis(ax, [p[1] for curve in dial.curves for p in curve.points])
    if dial.log:
        ax.set_yscale("log")
        percent = dial.title == "Sampling"
        label = (lambda value, _: f"{100 * value:g} %") if percent else count_label
        ax.yaxis.set_major_formatter(FuncFormatter(label))
        ax.yaxis.set_minor_formatter(NullFormatter())
        if min(values) == 0:
            none_band(ax, least)
    # Those that count have the first choice of a place.
    labels.sort(key=lambda label: not label[0])
    return [label[1:] for label in labels], lines


class AboveBand(LogLocator):
    def __init__(self, least):
        super().__init__()
        self.least = least

    def tick_values(self, vmin, vmax):
        return [tick for tick in super().tick_values(vmin, vmax) if tick > self.least]


def place_labels(ax, labels, lines):
    """Each label at the first of PLACES that is free, or at the freest, or nowhere."""
    renderer = ax.figure.canvas.get_renderer()
    pixels = ax.figure.dpi / 72
    inside = ax.get_window_extent(renderer)
    taken = [box_about(ax.transData.transform(label[:2]), 4 * pixels) for label in labels]
    taken += [text.get_window_extent(renderer) for text in ax.texts]
    for line in lines:
        for a, b in zip(line, line[1:]):
            (ax_, ay), (bx, by) = ax.transData.transform([a, b])
            steps = max(1, int(math.hypot(bx - ax_, by - ay) / (3 * pixels)))
            for i in range(steps + 1):
                at = (ax_ + (bx - ax_) * i / steps, ay + (by - ay) * i / steps)
                taken.append(box_about(at, 1 * pixels))
    for x, y, text, colour in labels:
        best = None
        for dx, dy, ha, va in PLACES:
            note = ax.annotate(
                text,
                (x, y),
                xytext=(dx, dy),
                textcoords="offset points",
                ha=ha,
                va=va,
                size=7.5,
                color=colour,
                zorder=4,
            )
            box = note.get_window_extent(renderer)
            area = box.width * box.height
            cost = area - common_area(box, inside) + sum(common_area(box, b) for b in taken)
            if best is None or cost < best[0]:
                if best:
                    best[1].remove()
                best = (cost, note, box)
            else:
                note.remove()
            if best[0] <= 0.01 * area:
                break
        if best[0] > CROWDED * area:
            best[1].remove()
        else:
            taken.append(best[2])


def box_about(at, half):
    return Bbox([[at[0] - half, at[1] - half], [at[0] + half, at[1] + half]])


def common_area(a, b):
    width = min(a.x1, b.x1) - max(a.x0, b.x0)
    height = min(a.y1, b.y1) - max(a.y0, b.y0)
    return width * height if width > 0 and height > 0 else 0
