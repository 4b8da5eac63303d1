# SPDX-License-Identifier: BSD-3-Clause
"""Draws the nodes of both topologies over six fibers:

    topologies.py PROGRAM OUT.png

PROGRAM is the executable of topologies.cpp, which asks the library for the nodes.
"""

import io
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, Rectangle
from PIL import Image

SEGMENTS, RADIUS = 80, 0.004
PLACES = (2, 5, 0, 3, 1, 4)  # of the roots from left to right, in the order of generation
# Okabe and Ito's colours, with a brown instead of their black.
COLOURS = "#0072b2 #e69f00 #009e73 #cc79a7 #56b4e9 #d55e00 #b8a800 #7a4b2a".split()
INK, SOFT = "#1f2430", "#70788a"
TITLES = {
    "super-thread": ("Super thread", "the paper: one chain, cut into runs"),
    "bundle": ("Bundle", "neighbouring fibers, cut into blocks"),
}


def hanging_fibers():
    """Points from root to tip, by fiber in the order of generation; slightly curly."""
    along = np.linspace(0, 1, SEGMENTS + 1)
    fibers = []
    for place in PLACES:
        spread = 0.075 * (place - 2.5) * (1 + 0.35 * np.sin(2.6 * along))
        wave = 0.014 * (0.3 + along) * np.sin(15 * along + 1.1 * place)
        sweep = 0.13 * np.sin(3.3 * along) * along
        drop = -along * (1 + 0.012 * np.cos(2.6 * place))
        fibers.append(np.stack([spread + wave + sweep, drop], axis=1))
    return fibers


def nodes_of(program, fibers):
    """By topology the nodes: the box, and for each fiber in the node the segments."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "fibers.txt"
        blocks = ["\n".join(f"{x:.6f} {y:.6f} 0" for x, y in points) for points in fibers]
        file.write_text("\n\n".join(blocks) + "\n")
        command = [program, str(file), str(RADIUS)]
        lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    nodes = {}
    for line in lines.splitlines():
        topology, *box_and_segments = line.split()
        segments = [tuple(map(int, at.split(":"))) for at in box_and_segments[4:]]
        nodes.setdefault(topology, []).append((np.array(box_and_segments[:4], float), segments))
    return nodes


def summary(nodes):
    boxes = np.array([box for box, _ in nodes])
    area = np.prod(boxes[:, 2:] - boxes[:, :2], axis=1).sum()
    low = np.maximum(boxes[:, None, :2], boxes[None, :, :2])
    high = np.minimum(boxes[:, None, 2:], boxes[None, :, 2:])
    pairs = (np.all(low <= high, axis=2).sum() - len(boxes)) // 2
    return f"{len(boxes)} boxes, {pairs} pairs overlap,\ntotal area {area:.2f}"


def draw_chain(axis, fibers):
    """Which way the super thread runs along each fiber, and its jumps to the next."""
    for f, points in enumerate(fibers):
        at = points[[38, 42] if f % 2 == 0 else [42, 38]]
        style = {"arrowstyle": "-|>", "mutation_scale": 13, "color": INK, "lw": 0}
        axis.add_patch(FancyArrowPatch(*at, zorder=5, shrinkA=0, shrinkB=0, **style))
    for f, (here, there) in enumerate(zip(fibers, fibers[1:])):
        a, b = (here[-1], there[-1]) if f % 2 == 0 else (here[0], there[0])
        bend = np.sign(b[0] - a[0]) * (0.35 if f % 2 == 0 else -0.35)
        style = {"connectionstyle": f"arc3,rad={bend}", "ls": ":", "lw": 1.2, "color": INK}
        axis.add_patch(FancyArrowPatch(a, b, arrowstyle="-", shrinkA=0, shrinkB=0, **style))


def draw(axis, topology, fibers, nodes):
    for (box, segments), colour in zip(nodes, COLOURS):
        low, size = box[:2], box[2:] - box[:2]
        axis.add_patch(Rectangle(low, *size, fc=colour, alpha=0.13, lw=0))
        axis.add_patch(Rectangle(low, *size, fill=False, ec=colour, alpha=0.55, lw=0.9))
        lines = [fibers[f][s : s + 2] for f, s in segments]
        axis.add_collection(LineCollection(lines, colors=colour, lw=3, capstyle="round", zorder=3))
    if topology == "super-thread":
        draw_chain(axis, fibers)
    for number, points in enumerate(fibers, 1):
        axis.plot(*points[0], "o", ms=13, mfc="white", mec=INK, mew=1, zorder=6)
        style = {"ha": "center", "va": "center_baseline", "fontsize": 8.5, "color": INK}
        axis.text(*points[0], number, zorder=7, **style)
    title, what = TITLES[topology]
    axis.text(0.02, 0.195, title, fontsize=16, weight="bold", color=INK, ha="center")
    axis.text(0.02, 0.13, what, fontsize=11, color=SOFT, ha="center")
    axis.text(0.02, -1.1, summary(nodes), fontsize=11.5, color=INK, ha="center", va="top")
    axis.set(xlim=(-0.44, 0.48), ylim=(-1.235, 0.26), aspect="equal")
    axis.axis("off")


def main():
    program, out = sys.argv[1:]
    fibers = hanging_fibers()
    figure = Figure(figsize=(8, 6.5), facecolor="white")
    whole = {"wspace": 0, "left": 0, "right": 1, "bottom": 0, "top": 1}
    axes = figure.subplots(1, 2, gridspec_kw=whole)
    for axis, (topology, nodes) in zip(axes, nodes_of(program, fibers).items()):
        draw(axis, topology, fibers, nodes)
    drawn = io.BytesIO()
    figure.savefig(drawn, dpi=150)
    Image.open(drawn).convert("RGB").quantize(128).save(out, optimize=True)


if __name__ == "__main__":
    main()
