# SPDX-License-Identifier: BSD-3-Clause
"""Writes fibers for gallery.sh, as text files:

    scenes.py FOLDER [DATA]

knot.txt      a closed rope; it touches itself at radius 0.1
tube.txt      stockinette, knitted in the round from one yarn; it touches itself at radius 0.125
ponytail.txt  the four files tressfx31_ponytail_*.tfx of the folder DATA
"""

import sys
from pathlib import Path

import numpy as np


def knot(leads=3, bights=8, segments=960):
    """A Turk's head: a rope goes around `leads` times and passes over and under in turn."""
    t = np.linspace(0, 2 * np.pi * leads, segments + 1) - np.pi * leads / (4 * bights)
    t[-1] = t[0]  # a closed fiber repeats its first point
    wave = bights * t / leads
    out = 1 + 0.38 * np.cos(wave)
    return [np.stack([out * np.cos(t), out * np.sin(t), 0.12 * np.sin(2 * wave)], axis=1)]


def tube(stitches=20, rounds=7, per_stitch=32):
    """Every stitch is a loop with a narrow neck. Its legs are outside, its head and feet inside.
    The feet of a round go through the heads of the round below."""
    t = np.linspace(0, 2 * np.pi * stitches * rounds, stitches * rounds * per_stitch + 1)
    turn = (t + 0.48 * np.pi * np.sin(2 * t)) / stitches
    out = stitches / (2 * np.pi) - 0.16 * np.cos(2 * t)
    height = 0.75 * np.cos(t) + 0.9 * t / (2 * np.pi * stitches)
    return [np.stack([out * np.cos(turn), out * np.sin(turn), height], axis=1)]


def tressfx(path):
    """Version 3: numbers of fibers and of points of each at byte 4, where points begin at 144."""
    fibers, points = np.fromfile(path, np.uint32, 2, offset=4)
    begin = np.fromfile(path, np.uint32, 1, offset=144)[0]
    return np.fromfile(path, np.float32, 3 * fibers * points, offset=begin).reshape(-1, points, 3)


def write(folder, name, fibers):
    with open(Path(folder) / f"{name}.txt", "w", encoding="ascii") as file:
        for points in fibers:
            np.savetxt(file, points, fmt="%.9g", footer="\n", comments="")


def main():
    folder, *data = sys.argv[1:]
    write(folder, "knot", knot())
    write(folder, "tube", tube())
    if data:
        parts = sorted(Path(data[0]).glob("tressfx31_ponytail_*.tfx"))
        write(folder, "ponytail", [points for part in parts for points in tressfx(part)])


if __name__ == "__main__":
    main()
