# SPDX-License-Identifier: BSD-3-Clause
"""The figures of the sets headline and trade, and what all figures share."""

import io

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from ratios import BOXES, CAPSULES, FCL

INK, SOFT, RED = "#1d2330", "#5b6475", "#e01b24"
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
    "LayeredAABBTree/boxes": ("boxes", "#0072b2", "o"),
    "LayeredAABBTree/capsules": ("boxes, capsules out", "#56b4e9", "D"),
    "LayeredAABBTree/super_thread": ("boxes, super thread", "#d55e00", "o"),
    "WrappedSphereTree/spheres": ("spheres", "#009e73", "s"),
    "WrappedSphereTree/capsules": ("spheres, capsules out", "#60c8a8", "D"),
    "WrappedSphereTree/super_thread": ("spheres, super thread", "#9b3f8f", "s"),
}
MARKERS = dict(zip(FCL, "^vPX<>x"))


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


def log_axis(axis, label, subs=(1,)):
    axis.axes.set(**{f"{axis.axis_name}scale": "log"})
    axis.set_major_locator(LogLocator(subs=subs))
    axis.set_major_formatter(FuncFormatter(label))
    axis.set_minor_formatter(NullFormatter())


def seconds_axis(axis, values):
    log_axis(axis, seconds_label, (1,) if max(values) > 200 * min(values) else (1, 2, 5))


def headline_bars(scene):
    """Groups of bars: (label, contender, colour)."""
    boxes = [("ours", BOXES, "#0072b2")]
    if scene.has_embree():
        boxes.append(("Embree", scene.best(scene.embree(), "frame"), "#e69f00"))
    touching = [("ours", CAPSULES, "#56b4e9")]
    for label, kind, colour in (("tight", "tight", "#5b6475"), ("its own", "stock", "#a3aab7")):
        best, collide = (scene.best(scene.fcl(kind, c), "frame") for c in (False, True))
        boxes.append((f"FCL, {label} boxes", best, colour))
        touching.append((f"FCL, {label} boxes + fcl::collide", collide, colour))
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
                error = [[middle - runs.min()], [runs.max() - middle]]
                axis.barh(at, middle, 0.72, color=colour, xerr=error, ecolor=INK, capsize=2)
                place = {"xytext": (4, 0), "textcoords": "offset points", "va": "center"}
                axis.annotate(seconds_label(middle), (runs.max(), at), color=INK, **place)
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


LEAST = 0.01  # false pairs per contact that the axis shows; exact ones stand at its foot


def style_of(name):
    """Label, colour, marker of a contender."""
    if name in OURS:
        return OURS[name]
    manager, variant = name.split("/")
    tight = variant.startswith("tight")
    return FCL[manager], "#22262e" if tight else "#a3aab7", MARKERS[manager]


def managers(points, fronts):
    """`points`: by the scene's title, (name, seconds, false pairs per contact)."""
    rows = (len(points) + 2) // 2
    figure = Figure(figsize=(10.5, 3.5 * rows))
    axes = figure.subplots(rows, 2, squeeze=False)
    cells, others = np.split(axes.flat, [len(points)])
    for axis in others:
        axis.axis("off")
    handles = {}
    for axis, (scene, found) in zip(cells, points.items()):
        front = [(p[1], max(p[2], LEAST)) for p in fronts[scene]]
        line = {"color": RED, "lw": 1.2, "where": "post", "zorder": 1}
        handles["Pareto front"] = axis.step(*zip(*front), **line)[0]
        for name, seconds, false in found:
            label, colour, marker = style_of(name)
            dot = {"c": colour, "marker": marker, "s": 42, "zorder": 2}
            handles[label] = axis.scatter(seconds, max(false, LEAST), **dot)
        log_axis(axis.yaxis, lambda value, _: "none" if value <= LEAST else count_label(value))
        seconds_axis(axis.xaxis, [p[1] for p in found])
        axis.set(title=scene, xlabel="update + detection", ylabel="false pairs per contact")
    handles["grey: FCL's own boxes, black: tight"] = Line2D([], [], ls="")
    others[0].legend(handles.values(), handles.keys(), loc="center", ncol=2, fontsize=9)
    figure.tight_layout()
    return png(figure)
