# SPDX-License-Identifier: BSD-3-Clause
"""The picture of packing.py: side views and cross-sections, coloured by the depth of overlaps."""

import matplotlib

matplotlib.use("Agg")  # also where there is no screen

import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.collections import EllipseCollection, LineCollection  # noqa: E402
from PIL import Image  # noqa: E402

DEPTHS = matplotlib.colors.LinearSegmentedColormap.from_list(
    "depths", ["#d5e3ec", "#f7cf6b", "#ee7b30", "#d7263d", "#7d1135"]
)
SCALE = matplotlib.cm.ScalarMappable(matplotlib.colors.Normalize(0, 1), DEPTHS)
EDGE = "#33424c"
WIDTH, SECTION = 186, 52  # of a side view and a cross-section, in radii of a fiber
HEIGHT = 90
PIECES = 3  # of a segment, so that those which lie on each other are painted in order


def draw(path, states):
    """States are title, nodes (fibers, n, 3) and contacts of each row of the picture."""
    figure, axes = plt.subplots(
        2, 2, figsize=(11.5, 7.0), width_ratios=[WIDTH, SECTION + 26], layout="constrained"
    )
    for (view, section), (title, _, _) in zip(axes, states):
        view.set(xlim=(-WIDTH / 2, WIDTH / 2), ylim=(-HEIGHT / 2, HEIGHT / 2))
        section.set(xlim=(-SECTION / 2, SECTION / 2), ylim=(-SECTION / 2, SECTION / 2))
        view.set_title(title, loc="left", fontsize=13)
        section.set_title("The waist, cut across", loc="left", fontsize=11)
    for axis in axes.flat:
        axis.set(aspect="equal", xticks=[], yticks=[])
        axis.spines[:].set_visible(False)
    bar = figure.colorbar(SCALE, ax=axes, shrink=0.5, aspect=30, pad=0.02, extend="max")
    bar.set_label("deepest overlap of a segment, in radii")
    bar.outline.set_visible(False)
    # Widths of lines are in points, and the layout decides how many of them a radius is.
    figure.draw_without_rendering()
    for (view, section), (_, nodes, contacts) in zip(axes, states):
        depth = np.zeros((len(nodes), nodes.shape[1] - 1))
        for side in "ab":
            at = contacts["fiber_" + side], contacts["segment_" + side]
            np.maximum.at(depth, at, -contacts["distance"])
        points = 72 / figure.dpi * view.get_window_extent().width / WIDTH
        draw_view(view, nodes, depth, points)
        draw_section(section, nodes, depth)
    figure.savefig(path, dpi=100)
    # A palette makes the file a third as large.
    drawn = Image.open(path).convert("RGB")
    drawn.quantize(200, method=Image.Quantize.MAXCOVERAGE).save(path, optimize=True)


def draw_view(axis, nodes, depth, points_per_radius):
    """The fibers from the side, as lines from the back to the front."""
    share = np.arange(PIECES + 1)[:, np.newaxis] / PIECES
    ends = nodes[:, :-1, np.newaxis] * (1 - share) + nodes[:, 1:, np.newaxis] * share
    pieces = np.stack([ends[:, :, :-1], ends[:, :, 1:]], axis=3).reshape(-1, 2, 3)
    lines, height = pieces[:, :, [2, 1]], pieces[:, :, 0].mean(axis=1)
    colour = SCALE.to_rgba(np.repeat(depth.ravel(), PIECES))
    # What is far is darker. A dark line below, and a light one above, make a tube of each line.
    near = (height - height.min()) / np.ptp(height)
    colour[:, :3] *= (0.62 + 0.38 * near)[:, np.newaxis]
    edge = colour * [0.32, 0.32, 0.36, 1]
    light = colour + (1 - colour) * [0.6, 0.6, 0.6, 1]
    order = np.argsort(np.concatenate([height - 0.7, height, height + 0.5]), kind="stable")
    widths = points_per_radius * np.repeat([2.0, 1.45, 0.4], len(lines))
    axis.add_collection(
        LineCollection(
            np.concatenate([lines, lines, lines + [0, 0.3]])[order],
            colors=np.concatenate([edge, colour, light])[order],
            linewidths=widths[order],
            capstyle="round",
        )
    )


def draw_section(axis, nodes, depth):
    """A circle for each fiber, where it passes the plane in the middle."""
    fibers = np.arange(len(nodes))
    below = np.argmax(nodes[:, 1:, 2] > 0, axis=1)
    low, high = nodes[fibers, below], nodes[fibers, below + 1]
    at = low - low[:, 2:] / (high[:, 2:] - low[:, 2:]) * (high - low)
    across = np.full(len(nodes), 2.0)
    axis.add_collection(
        EllipseCollection(
            across,
            across,
            np.zeros(len(nodes)),
            units="x",
            offsets=at[:, :2],
            offset_transform=axis.transData,
            facecolors=SCALE.to_rgba(depth[fibers, below], alpha=0.85),
            edgecolors=EDGE,
            linewidths=0.8,
        )
    )
