#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The pictures of docs/tutorials, of the files that the examples write:

    mkdir out
    for name in swap hair_step gust hair_head harness obstacles safe_steps; do
      build-examples/$name out
    done
    build-examples/yarn out/knit.vtp
    docs/pictures/tutorials.py out docs/images/tutorials
"""

import base64
import io
import itertools
import math
import struct
import sys
import xml.etree.ElementTree
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from PIL import Image  # noqa: E402

HAIR, RED, LINK = "#8a5a2b", "#d62728", "#7a94b0"


def read(path):
    """The points of a .vtp file of this library, as lists of x, y, z, and its lines of points."""
    root = xml.etree.ElementTree.parse(path).getroot()

    def numbers(element, code):
        data = base64.b64decode(element.text)
        return [n[0] for n in struct.iter_unpack(f"<{code}", data[8:])]  # after their size

    flat = numbers(root.find(".//Points/DataArray"), "d")
    points = list(zip(flat[::3], flat[1::3], flat[2::3]))
    ends = numbers(root.find(".//Lines/DataArray[@Name='offsets']"), "q")
    return points, [points[a:b] for a, b in zip([0] + ends, ends)]


def draw(axes, fibers, contacts, project, width=0.8, size=4):
    """Fibers as lines and contacts as red points, in the plane of `project`."""
    for fiber in fibers:
        axes.plot(*zip(*map(project, fiber)), color=HAIR, linewidth=width)
    if contacts:
        axes.scatter(*zip(*map(project, contacts)), s=size, color=RED, zorder=3, linewidths=0)
    axes.set_aspect("equal")
    axes.axis("off")


def turned(angle, tilt):
    """A view from the side, turned about z and tilted."""
    c, s, up, down = math.cos(angle), math.sin(angle), math.cos(tilt), math.sin(tilt)
    return lambda p: (c * p[0] - s * p[1], up * p[2] + down * (s * p[0] + c * p[1]))


def side(p):
    return p[0], p[2]


def outline(points, **look):
    """Of the convex hull of points in the plane."""
    around = [math.tau * i / 90 for i in range(90)]
    hull = [max(points, key=lambda p: p[0] * math.cos(a) + p[1] * math.sin(a)) for a in around]
    return plt.Polygon(hull, linewidth=0, **look)


def swap(folder):
    figure, axes = plt.subplots(1, 2, figsize=(8, 4.2), width_ratios=(1, 1.2))
    fibers = read(folder / "swap_fibers.vtp")[1]
    contacts = read(folder / "swap_contacts.vtp")[0]
    draw(axes[0], fibers, contacts, side, 0.4, 2)
    axes[0].set_title(f"a lock, {len(contacts)} contacts in red")
    # A segment, and the boxes of FCL and of this library: of its ball, and of the capsule itself.
    length, radius, angle = 0.3, 0.02, 0.6
    x, y = length / 2 * math.cos(angle), length / 2 * math.sin(angle)
    axes[1].plot([-x, x], [-y, y], color=HAIR, linewidth=18, solid_capstyle="round")
    for w, h, color, name in (
        (length / 2 + radius, length / 2 + radius, LINK, "FCL's box"),
        (x + radius, y + radius, RED, "tight box"),
    ):
        axes[1].add_patch(plt.Rectangle((-w, -h), 2 * w, 2 * h, fill=False, color=color, lw=2))
        axes[1].text(-w, h + 0.003, name, color=color, fontsize=12)
    axes[1].set(aspect="equal", title="one segment and its boxes")
    axes[1].set(xlim=(-0.21, 0.21), ylim=(-0.2, 0.21))
    axes[1].axis("off")
    return figure


def hair_step(folder):
    figure, axes = plt.subplots(1, 4, figsize=(8, 3), sharex=True, sharey=True)
    for step, axis in zip((240, 280, 320, 440), axes):
        fibers = read(folder / f"hair_step_{step}_fibers.vtp")[1]
        contacts = read(folder / f"hair_step_{step}_contacts.vtp")[0]
        draw(axis, fibers, contacts, side, 0.7, 5)
        axis.set_title(f"step {step}")
    return figure


def gust(folder):
    figure, axes = plt.subplots(1, 3, figsize=(8, 3.6), sharex=True, sharey=True)
    titles = {"start": "start", "end": "end", "step": "the whole step"}
    for (name, title), axis in zip(titles.items(), axes):
        fibers = read(folder / f"gust_{name}_fibers.vtp")[1]
        contacts = read(folder / f"gust_{name}_contacts.vtp")[0]
        draw(axis, fibers, contacts, side, 0.3, 1)
        axis.set_title(f"{title}: {len(contacts):,} pairs")
    return figure


def hair_head(folder):
    figure, axes = plt.subplots(1, 3, figsize=(8, 2.8), sharex=True, sharey=True)
    for step, axis in zip((50, 100, 400), axes):
        *fibers, head = read(folder / f"hair_head_{step}_fibers.vtp")[1]
        contacts = read(folder / f"hair_head_{step}_contacts.vtp")[0]
        # Seen along x. What is behind the middle of the head comes first, then the head.
        for sign, layer in ((-1, 1), (1, 3)):

            def project(p):
                return p[1:] if sign * p[0] >= 0 else (math.nan, math.nan)

            draw(axis, fibers, [], project, 0.6)
            for line in axis.lines[-len(fibers) :]:
                line.set_zorder(layer)
            seen = [project(p) for p in contacts]
            axis.scatter(*zip(*seen), s=2, color=RED, zorder=layer + 0.5, linewidths=0)
        axis.add_patch(outline([p[1:] for p in head], color=LINK, zorder=2))
        axis.set_title(f"step {step}")
    return figure


def harness(folder):
    figure, axes = plt.subplots(1, 4, figsize=(8, 5), sharex=True, sharey=True)
    for degrees, axis in zip((12, 18, 22, 24), axes):
        *links, shortest = read(folder / f"harness_{degrees}_links.vtp")[1]
        fibers = read(folder / f"harness_{degrees}_fibers.vtp")[1]
        contacts = read(folder / f"harness_{degrees}_contacts.vtp")[0]
        for link in links:
            axis.add_patch(outline(list(map(side, link)), facecolor=LINK, alpha=0.7))
        draw(axis, fibers, contacts, side, 1.5, 3)
        if not contacts:
            axis.plot(*zip(*map(side, shortest)), color=RED, linewidth=2)
        axis.set_title(f"{degrees} degrees")
    return figure


def sphere_points():
    for polar in range(19):
        for turn in range(36):
            p, t = math.pi * polar / 18, math.tau * turn / 36
            yield math.sin(p) * math.cos(t), math.sin(p) * math.sin(t), math.cos(p)


def obstacles(folder):
    figure, axis = plt.subplots(figsize=(8, 4))
    fibers = read(folder / "obstacles_fibers.vtp")[1]
    contacts = read(folder / "obstacles_contacts.vtp")[0]
    view = turned(0.4, 0.6)
    # The obstacles of obstacles.cpp: middle, half sizes, and whether round.
    for x, y, half, is_round in (
        (0.21, 0.21, (0.08, 0.08, 0.08), True),
        (0.65, 0.23, (0.1, 0.06, 0.05), False),
        (0.45, 0.65, (0.12, 0.09, 0.08), True),
    ):
        seen = [
            view([m + h * d for m, h, d in zip((x, y, 0.08), half, direction)])
            for direction in (sphere_points() if is_round else itertools.product((-1, 1), repeat=3))
        ]
        axis.add_patch(outline(seen, color=LINK, alpha=0.6, zorder=2.5))
    draw(axis, fibers, contacts, view, 0.6, 8)
    return figure


def yarn(folder):
    figure, axes = plt.subplots(1, 2, figsize=(8, 4))
    fibers = read(folder / "knit.vtp")[1]
    contacts = read(folder / "knit_contacts.vtp")[0]

    def in_front(p):  # four courses, flattened
        return p[1:] if p[0] > 17 and 3 < p[2] < 22 else (math.nan, math.nan)

    draw(axes[0], fibers, [], turned(0.3, 0.4), 0.8)
    draw(axes[1], fibers, contacts, in_front, 6, 12)
    return figure


def safe_steps(folder):
    """The tassel from the side, and cut across where the band is."""
    figure, axes = plt.subplots(2, 3, figsize=(8, 6.4), height_ratios=(1.6, 1), sharex=True)
    for iteration, (view, section) in zip((0, 200, 500), axes.T):
        fibers = read(folder / f"safe_steps_{iteration}.vtp")[1]
        # From the back to the front.
        fibers.sort(key=lambda fiber: -fiber[0][1])
        for fiber in fibers:
            view.plot(*zip(*map(side, fiber)), color="white", linewidth=3.4)
            view.plot(*zip(*map(side, fiber)), color=HAIR, linewidth=2.4)
        view.axhline(-60, color=RED, linewidth=1, linestyle=":")
        view.set_title(f"iteration {iteration}")
        for fiber in fibers:
            for p, q in zip(fiber, fiber[1:]):
                if (p[2] > -60) != (q[2] > -60):
                    t = (-60 - p[2]) / (q[2] - p[2])
                    middle = p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])
                    section.add_patch(plt.Circle(middle, 1, facecolor=HAIR, linewidth=0))
        view.set(aspect="equal", ylim=(-125, 3))
        section.set(aspect="equal", xlim=(-32, 32), ylim=(-26, 26))
        view.axis("off")
        section.axis("off")
    return figure


def main():
    folder, to = map(Path, sys.argv[1:])
    for draw_one in (swap, hair_step, gust, hair_head, harness, obstacles, yarn, safe_steps):
        figure = draw_one(folder)
        figure.tight_layout()
        drawn = io.BytesIO()
        figure.savefig(drawn, dpi=100)
        few_colors = Image.open(drawn).convert("RGB").quantize(32)
        few_colors.save(to / f"{draw_one.__name__}.png", optimize=True)


if __name__ == "__main__":
    main()
