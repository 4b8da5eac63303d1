# SPDX-License-Identifier: BSD-3-Clause
"""Writes fibers for gallery.sh, as text files, and a mesh:

    scenes.py FOLDER [DATA]

head.obj      a head of radius 9, closed; its face is on the side of x
parting.txt   hair from a parting on top of it down to both ears; it lies on the head
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


def bump(y, z, across, up, width, height):
    """1 at the place (across, up) of the face, and nearly 0 around it."""
    return np.exp(-(((y - across) / width) ** 2) - ((z - up) / height) ** 2)


def head_at(x, y, z):
    """The point of the head to which a point of the unit sphere belongs."""
    low, front = np.clip(-z, 0, None) ** 2, np.clip(x, 0, None)
    eyes = bump(y, z, -0.33, -0.02, 0.14, 0.1) + bump(y, z, 0.33, -0.02, 0.14, 0.1)
    face = 0.17 * bump(y, z, 0, -0.22, 0.11, 0.16) - 0.07 * eyes + 0.18 * low * front
    x = x * (1 - 0.28 * low) + face * (x > 0)
    return 9 * np.stack([x, y * (1 - 0.35 * low), z * (1 + 0.22 * np.sqrt(low))], axis=-1)


def head(rings=150, sectors=200):
    """Points, and faces of three or four of them, counterclockwise from outside."""
    down = np.pi * np.arange(1, rings)[:, None] / rings
    around = 2 * np.pi * np.arange(sectors) / sectors
    ball = np.sin(down) * np.cos(around), np.sin(down) * np.sin(around), np.cos(down) + 0 * around
    points = [head_at(0.0, 0.0, 1.0), *head_at(*ball).reshape(-1, 3), head_at(0.0, 0.0, -1.0)]
    faces, south, last = [], len(points) - 1, (rings - 2) * sectors
    for a in range(1, sectors + 1):
        b = a % sectors + 1
        faces += [(0, a, b), (south, last + b, last + a)]
        faces += [(a + r, a + r + sectors, b + r + sectors, b + r) for r in range(0, last, sectors)]
    return points, faces


def parting(hairs=1600, segments=60):
    random = np.random.default_rng(1)
    t = np.linspace(0, 1, segments + 1)
    for i in range(hairs):
        back = np.radians(random.uniform(-55, 65))  # of the root, from the top of the head
        down = np.radians(random.uniform(2, 100) + random.uniform(20, 60) * t) * (-1) ** i
        back = back + 0.35 * t + 0.03 * np.sin(12 * t + random.uniform(0, 6))
        x, y, z = -np.sin(back), np.sin(down) * np.cos(back), np.cos(down) * np.cos(back)
        lift = 0.012 + 0.012 * np.sin(7 * t + random.uniform(0, 6)) + random.uniform(0, 0.03) * t
        yield head_at(x, y, z) * (1 + lift)[:, None]


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
    points, faces = head()
    with open(Path(folder) / "head.obj", "w", encoding="ascii") as file:
        np.savetxt(file, points, fmt="v %.7g %.7g %.7g")
        file.writelines("f " + " ".join(str(i + 1) for i in face) + "\n" for face in faces)
    write(folder, "parting", parting())
    write(folder, "knot", knot())
    write(folder, "tube", tube())
    if data:
        parts = sorted(Path(data[0]).glob("tressfx31_ponytail_*.tfx"))
        write(folder, "ponytail", [points for part in parts for points in tressfx(part)])


if __name__ == "__main__":
    main()
