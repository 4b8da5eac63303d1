# SPDX-License-Identifier: BSD-3-Clause
"""Curves and pictures of the set paper."""

import io
import math
from dataclasses import dataclass
from functools import partial

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from matplotlib.ticker import FuncFormatter, NullFormatter
from PIL import Image

from pictures import INK, OURS, RED, png
from ratios import FCL

FCL_TREE = ("DynamicAABBTree", "DynamicAABBTree_Array")
LINES = dict(zip(FCL.values(), ("k-", "k:", "C7-", "C7--", "C7-.", "C7:", "y-")))
LINES |= {"n": ":", "n^(4/3)": "--"}


def label_of(name):
    """Both forms of FCL's dynamic tree have one: that which is faster is shown."""
    return OURS[name][0] if name in OURS else FCL[name.split("/")[0]].removesuffix(", array")


@dataclass
class Panel:
    title: str
    curves: dict  # points by label
    xlabel: str
    xscale: str = "linear"
    yscale: str = "linear"
    x_format: object = None
    y_format: object = None
    marker: str = "o"

    def draw(self, axis):
        colours = {label: {"color": colour} for label, colour in OURS.values()}
        for label, points in self.curves.items():
            line = {"lw": 1.7, "marker": self.marker, **colours.get(label, {})}
            if label in LINES:
                line["lw"] = 1.1
            if label.startswith("n"):
                line |= {"color": INK, "marker": ""}
            axis.plot(*np.array(points).T, LINES.get(label, "-"), ms=4, label=label, **line)
        axis.set(title=self.title, xlabel=self.xlabel, xscale=self.xscale, yscale=self.yscale)
        for along, form in ((axis.xaxis, self.x_format), (axis.yaxis, self.y_format)):
            if form:
                along.set_major_formatter(FuncFormatter(form))
                along.set_minor_formatter(NullFormatter())
        if self.yscale == "linear":
            axis.set_ylim(bottom=0)


def panels_figure(panels):
    """Side by side, with one legend below."""
    figure = Figure(figsize=(10.4 if len(panels) > 1 else 6.4, 3.9))
    axes = figure.subplots(1, len(panels), squeeze=False)[0]
    handles = {}
    for panel, axis in zip(panels, axes):
        panel.draw(axis)
        for handle, label in zip(*axis.get_legend_handles_labels()):
            handles.setdefault(label, handle)
    place = {"loc": "upper center", "bbox_to_anchor": (0.5, 0), "ncol": 4, "fontsize": 8.8}
    place["handlelength"] = 4  # A shorter line does not tell dashes from dashes and dots.
    figure.legend(handles.values(), handles.keys(), **place)
    figure.tight_layout()
    return png(figure)


class Picture:
    """Fibers and which of their segments touch, as --measure=pictures wrote them."""

    def __init__(self, folder, name):
        self.points = np.fromfile(folder / f"{name}.points", dtype=np.float32).reshape(-1, 3)
        self.begin = np.fromfile(folder / f"{name}.begin", dtype=np.int32)
        self.touching = np.fromfile(folder / f"{name}.touching", dtype=np.uint8).astype(bool)

    def segments(self, step):
        """Ends, fibers, and whether they touch; so many segments of a fiber in one."""
        sizes = np.diff(self.begin) - 1
        fiber = np.repeat(np.arange(len(sizes)), sizes)
        within = np.arange(len(fiber)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
        first = np.flatnonzero(within % step == 0)
        touching = np.logical_or.reduceat(self.touching, first)
        fiber, within = fiber[first], within[first]
        a = self.begin[fiber] + within
        b = np.minimum(a + step, self.begin[fiber + 1] - 1)
        return self.points[a], self.points[b], fiber, touching


def principal_view(points):
    """Rows: right, up, towards the viewer. The longest direction is up, the roots are on top."""
    sample = points[:: max(1, len(points) // 20000)]
    axes = np.linalg.svd(sample - sample.mean(axis=0), full_matrices=False)[2]
    up = axes[0] if (points[0] - points.mean(axis=0)) @ axes[0] > 0 else -axes[0]
    return np.stack([axes[1], up, np.cross(axes[1], up)])


def turned_view(azimuth, elevation):
    a, e = math.radians(azimuth), math.radians(elevation)
    towards = np.array([math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)])
    right = np.array([-math.sin(a), math.cos(a), 0.0])
    return np.stack([right, np.cross(towards, right), towards])


def draw_fibers(axis, picture, view, width, step=1, share=1, red=True, dots=0, window=None):
    """Darker behind. `dots`: of this size on touching segments that are too short to be seen."""
    a, b, fiber, touching = picture.segments(step)
    a, b = a @ view.T, b @ view.T
    random = np.random.default_rng(5)
    tones, drawn = random.uniform(-0.09, 0.09, fiber.max() + 1), random.random(fiber.max() + 1)
    keep = drawn[fiber] <= share
    if window is not None:
        keep &= np.all((a[:, :2] > window[0]) & (a[:, :2] < window[1]), axis=1)
        axis.set(xlim=(window[0][0], window[1][0]), ylim=(window[0][1], window[1][1]))
    a, b, fiber, touching = a[keep], b[keep], fiber[keep], touching[keep]
    order = np.argsort(a[:, 2])
    a, b, fiber, touching = a[order], b[order], fiber[order], touching[order]
    shade = np.linspace(0.55, 1.15, len(a)) + tones[fiber]
    colours = np.clip(np.array([0.56, 0.41, 0.26]) * shade[:, None], 0, 1)
    if red:
        colours[touching] = matplotlib.colors.to_rgb(RED)
        middle = (a[touching] + b[touching]) / 2
        axis.scatter(middle[:, 0], middle[:, 1], s=dots, color=RED, lw=0, zorder=3)
    lines = np.stack([a[:, :2], b[:, :2]], axis=1)
    axis.add_collection(LineCollection(lines, colors=colours, lw=width, capstyle="round"))
    axis.set_aspect("equal")
    axis.autoscale(window is None)
    axis.axis("off")


def strand(picture):
    """Whole, with touching segments red, and a part of it."""
    view = principal_view(picture.points)
    figure = Figure(figsize=(10.4, 6.4))
    left, middle, right = figure.subplots(1, 3, gridspec_kw={"width_ratios": [1, 1, 1.5]})
    draw_fibers(left, picture, view, 0.35, step=8, red=False)
    draw_fibers(middle, picture, view, 0.35, step=8, dots=1.2)
    projected = (picture.points @ view.T)[:, :2]
    half = 0.06 * np.ptp(projected[:, 1]) * np.array([0.8, 1.2])
    points = picture.begin[1]
    centre = np.median(projected[int(0.85 * points) :: points], axis=0)
    low, high = centre - half, centre + half
    draw_fibers(right, picture, view, 0.8, dots=8, window=(low, high))
    middle.add_patch(Rectangle(low, *(high - low), fill=False, color=INK, lw=0.9))
    return figure


def draw_volumes(axis, nodes, kind, depth, view, width, alpha=1.0):
    """The nodes of one depth, in the colours of their order."""
    edges = [(i, i | 1 << k) for i in range(8) for k in range(3) if not i >> k & 1]
    level = nodes[(nodes["kind"] == kind) & (nodes["depth"] == depth)]
    for i, numbers in enumerate(level[list("abcdef")].to_numpy()):
        look = {"lw": width, "alpha": alpha}
        if kind == "box":
            ends = numbers.reshape(2, 3)
            at = np.array([[ends[c >> k & 1][k] for k in range(3)] for c in range(8)]) @ view.T
            lines = [at[list(edge), :2] for edge in edges]
            axis.add_collection(LineCollection(lines, colors=f"C{i % 10}", **look))
        else:
            centre = (numbers[:3] @ view.T)[:2]
            axis.add_patch(Circle(centre, numbers[3], fill=False, color=f"C{i % 10}", **look))


def loop(folder, name, depth=11):
    """Touching segments red, and the cages of one depth."""
    picture, nodes = Picture(folder, name), pd.read_csv(folder / f"{name}.csv")
    view = principal_view(picture.points)
    figure = Figure(figsize=(10.4, 4.6))
    left, right = figure.subplots(1, 2, sharex=True, sharey=True)
    draw_fibers(left, picture, view, 0.6)
    draw_fibers(right, picture, view, 0.6, red=False)
    draw_volumes(right, nodes, "sphere", depth, view, 0.4, alpha=0.5)
    right.autoscale_view()
    left.set_title("touching segments red")
    right.set_title(f"wrapped spheres at depth {depth}")
    return png(figure)


def half_scalp(picture):
    figure = Figure(figsize=(10.4, 5.2))
    for axis, red in zip(figure.subplots(1, 2), (False, True)):
        draw_fibers(axis, picture, turned_view(60, 12), 0.12, red=red)
    return figure


def drawn(draw, folder, name):
    """With few colours, which makes a half of the bytes of a head of hair."""
    image = Image.open(io.BytesIO(png(draw(Picture(folder, name)))))
    buffer = io.BytesIO()
    image.convert("RGB").quantize(64).save(buffer, "PNG", optimize=True)
    return buffer.getvalue()


def caption(part, name):
    if name == "volumes":
        return "One filament of the dynamic assembly."
    keys = ("fibers", "segments", "touching_pairs", "touching_segments")
    fibers, segments, pairs, touching = part.medians("Picture", name, *keys)
    return (
        f"{fibers:,.0f} fibers, {segments:,.0f} segments, {pairs:,.0f} touching pairs on "
        f"{100 * touching / segments:.1f} % of the segments. Touching segments are red."
    )


def volumes(folder, _, depth=2):
    """One filament in the boxes and in the wrapped spheres of two depths."""
    fiber = Picture(folder, "volumes").points
    nodes = pd.read_csv(folder / "volumes.csv")
    view = principal_view(fiber)
    figure = Figure(figsize=(8, 4.6))
    for axis, kind in zip(figure.subplots(1, 2), ("box", "sphere")):
        axis.plot(*(fiber @ view.T)[:, :2].T, color=INK, lw=1.6, zorder=5)
        draw_volumes(axis, nodes, kind, depth, view, 2.4)
        draw_volumes(axis, nodes, kind, depth + 1, view, 0.9)
        axis.set_title(
            {"box": "boxes", "sphere": "wrapped spheres"}[kind]
            + f" at depth {depth} (thick) and {depth + 1}"
        )
        axis.set_aspect("equal")
        axis.autoscale_view()
        axis.axis("off")
    return png(figure)


IN_DOCUMENTS = {
    "loop": "paper_dynamic",
    "volumes": "paper_volumes",
    "half_scalp": "paper_half_scalp",
    "strand": "paper_strand",
}
PICTURES = {  # by the names of files: title, and who draws it
    "strand": ("Figs. 1 and 6. Strand", partial(drawn, strand)),
    "loop": ("Fig. 3. The dynamic assembly late in its motion", loop),
    "volumes": ("Fig. 4. Volumes of two levels", volumes),
    "half_scalp": ("Fig. 2, right. Half scalp, every hair", partial(drawn, half_scalp)),
}
