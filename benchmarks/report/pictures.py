# SPDX-License-Identifier: BSD-3-Clause
"""The figures of the sets headline and trade, and what all figures share."""

import io

import matplotlib
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

import interval
from ratios import BOXES, CAPSULES, COLLIDE, TEST

INK, RED = "#1d2330", "#e01b24"
matplotlib.rcParams.update(
    {
        "font.family": ["DejaVu Sans"],
        "font.size": 9.5,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.titlesize": 10.5,
        "axes.titlelocation": "left",
        "axes.titleweight": "bold",
        "axes.grid": True,
        "grid.color": "#e6e9ef",
        "grid.linewidth": 0.7,
        "axes.axisbelow": True,
        "legend.frameon": False,
    }
)
# Okabe-Ito colours, which most eyes tell apart. Ours in colour, FCL's in grey.
OURS = {
    "LayeredAABBTree/boxes": ("boxes", "#0072b2"),
    "LayeredAABBTree/capsules": ("boxes, kCapsules", "#56b4e9"),
    "LayeredAABBTree/super_thread": ("boxes, super thread", "#d55e00"),
    "WrappedSphereTree/spheres": ("spheres", "#009e73"),
    "WrappedSphereTree/capsules": ("spheres, kCapsules", "#60c8a8"),
    "WrappedSphereTree/super_thread": ("spheres, super thread", "#9b3f8f"),
}


def png(figure):
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=120, bbox_inches="tight", metadata={"Software": None})
    return buffer.getvalue()


def seconds_label(value, _=None):
    for unit, scale in (("s", 1), ("ms", 1e-3), ("µs", 1e-6)):
        if value >= scale * 0.9999:
            return f"{value / scale:.3g} {unit}"
    return f"{value:g} s"


def count_label(value, _=None):
    for unit, scale in (("M", 1e6), ("k", 1e3)):
        if value >= scale:
            return f"{value / scale:g}{unit}"
    return f"{value:g}"


def log_axis(axis, label):
    axis.axes.set(**{f"{axis.axis_name}scale": "log"})
    axis.set_major_locator(LogLocator())
    axis.set_major_formatter(FuncFormatter(label))
    axis.set_minor_formatter(NullFormatter())


def headline_bars(scene):
    """Groups of bars: (label, contender, colour)."""
    boxes, touching = [("ours", BOXES, "#0072b2")], [("ours", CAPSULES, "#56b4e9")]
    for group, label, library, kind, then, colour in (
        (boxes, "Embree", "Embree", "", "", "#e69f00"),
        (boxes, "uniform grid", "Grid", "", "", "#cc79a7"),
        (boxes, "FCL, tight boxes", "FCL", "tight", "", "#5b6475"),
        (boxes, "FCL, its own boxes", "FCL", "stock", "", "#a3aab7"),
        (touching, "uniform grid + capsule test", "Grid", "", TEST, "#cc79a7"),
        (touching, "coal, tight boxes + capsule test", "coal", "tight", TEST, "#d55e00"),
        (touching, "Embree + capsule test", "Embree", "", TEST, "#e69f00"),
        (touching, "FCL, tight boxes + capsule test", "FCL", "tight", TEST, "#5b6475"),
        (touching, "FCL, tight boxes + fcl::collide", "FCL", "tight", COLLIDE, "#7e8797"),
        (touching, "FCL, its own boxes + fcl::collide", "FCL", "stock", COLLIDE, "#a3aab7"),
    ):
        names = scene.of(library, kind, then)
        if names:
            group.append((label, scene.best(names, "frame"), colour))
    return {"pairs whose boxes overlap": boxes, "pairs that touch": touching}


def headline(scenes):
    """One picture a scene: bars of a frame's time, one thread, shortest above."""
    figure = Figure(figsize=(2.4 + 3.2 * len(scenes), 3.6))
    axes = figure.subplots(1, len(scenes), sharey=True, squeeze=False)[0]
    for axis, scene in zip(axes, scenes.values()):
        at, ticks, values = 0.0, [], []
        for group, bars in headline_bars(scene).items():
            left = axis.get_yaxis_transform()
            axis.text(0, at, group, transform=left, weight="bold", va="center")
            for label, name, colour in bars:
                at += 1
                runs = scene.part.runs("Frames", name, "frame")
                middle = runs.median()
                low, high = interval.of_median(runs)
                error = [[middle - low], [high - middle]]
                axis.barh(at, middle, 0.72, color=colour, xerr=error, ecolor=INK, capsize=2)
                place = {"xytext": (4, 0), "textcoords": "offset points", "va": "center"}
                axis.annotate(seconds_label(middle), (high, at), color=INK, **place)
                ticks.append((at, label))
                values.append(middle)
            at += 1.3
        log_axis(axis.xaxis, seconds_label)
        axis.set(xlim=(min(values) / 3, max(values) * 9), ylim=(at - 0.5, -1))
        axis.set_yticks(*zip(*ticks), color=INK)
        axis.grid(axis="y", visible=False)
        axis.set_title(scene.title())
    axes[len(axes) // 2].set_xlabel("update + detection, one thread, logarithmic")
    figure.tight_layout(w_pad=1.5)
    return png(figure)
