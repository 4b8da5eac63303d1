# SPDX-License-Identifier: BSD-3-Clause
"""Writes fibers for gallery.sh and for docs/trade.md, as text files, and meshes:

    scenes.py FOLDER [DATA]

head.obj      a head of radius 9, closed; its face is on the side of x
parting.txt   hair from a parting on top of it down to both ears; it lies on the head
knot.txt      a closed rope; it touches itself at radius 0.1
tube.txt      stockinette, knitted in the round from one yarn; it touches itself at radius 0.125
cables.txt    a harness along a robot's arm, in metres, with a radius of 0.004
arm.obj       the arm, closed; some cables touch it
neuron.swc    a neuron of eight stems, which branch; in micrometres
tract.txt     bundles of streamlines that cross, in mm; they touch at radius 0.05
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


def arm_frames(n, bend=0.5, length=2.0):
    """Points and axes along a curve that bends more and more: (n, 3) and (n, 3, 3)."""
    along = np.linspace(0, length, n)
    turn = np.concatenate([[0], np.cumsum(bend * (1 + along[1:]) * np.diff(along))])
    way = np.stack([np.sin(turn), 0 * turn, np.cos(turn)], axis=1)
    side = np.stack([np.cos(turn), 0 * turn, -np.sin(turn)], axis=1)
    up = np.broadcast_to([0.0, 1.0, 0.0], way.shape)
    steps = 0.5 * (way[1:] + way[:-1]) * np.diff(along)[:, None]
    return np.concatenate([[np.zeros(3)], np.cumsum(steps, axis=0)]), np.stack([side, up, way], 1)


def around(points, axes, radius, angle):
    """The points at that distance and angle from a curve, one for each of its points."""
    across = np.cos(angle)[..., None] * axes[:, 0] + np.sin(angle)[..., None] * axes[:, 1]
    return points + np.asarray(radius)[..., None] * across


def cables(count=150, segments=100):
    random = np.random.RandomState(1)
    points, axes = arm_frames(segments + 1)
    for _ in range(count):
        out, turn = 0.053 + 0.1 * random.rand() ** 2, 2 * np.pi * random.rand()
        winding = 0.04 * random.randn() * np.arange(segments + 1)
        yield around(points, axes, np.full(segments + 1, out), turn + winding)


def arm(rings=240, sectors=60):
    """A tube of radius 0.05 m with bulges at its joints, and its triangles."""
    points, axes = arm_frames(rings)
    radius = 0.045 + 0.005 * np.cos(np.linspace(0, 20 * np.pi, rings)) ** 2
    angles = 2 * np.pi * np.arange(sectors) / sectors
    tube = np.stack([around(points, axes, radius, np.full(rings, a)) for a in angles], axis=1)
    faces, last = [], rings * sectors
    for i in range(sectors):
        j = (i + 1) % sectors
        faces += [
            (i + r, j + r, j + r + sectors, i + r + sectors)
            for r in range(0, last - sectors, sectors)
        ]
        faces += [(last, j, i), (last + 1, last - sectors + i, last - sectors + j)]
    return [*tube.reshape(-1, 3), points[0], points[-1]], faces


def neuron(random=np.random.RandomState(1)):
    """Samples of .swc: x, y, z, the radius, and the sample before it."""
    samples = [(0.0, 0.0, 0.0, 5.0, -1)]
    tips = [(0, way / np.linalg.norm(way), 1.2) for way in random.randn(8, 3)]
    for _ in range(300):
        grown = []
        for parent, way, radius in tips:
            way = way + 0.4 * random.randn(3)
            way /= np.linalg.norm(way)
            radius = max(0.3, radius * (1 + 0.05 * random.randn()) * 0.995)
            samples.append((*(np.array(samples[parent][:3]) + 2 * way), radius, parent))
            ways = [way, way + random.randn(3)] if random.rand() < 0.01 else [way]
            grown += [(len(samples) - 1, w / np.linalg.norm(w), radius) for w in ways]
        tips = grown
    return samples


def tract(streamlines=2000, bundles=10):
    random = np.random.RandomState(1)
    along = np.arange(101) - 50.0
    radius = 0.2 * np.sqrt(streamlines / bundles)
    for i in range(streamlines):
        bundle = i % bundles
        angle, out = 2 * np.pi * random.rand(), radius * np.sqrt(random.rand())
        wander, phase = 0.2 * random.randn(2), 6 * random.rand(2)
        x, y = (wander[k] * np.sin(along / 20 + phase[k]) for k in (0, 1))
        way, side = bundle % 2, 1 - bundle % 2
        points = np.empty((len(along), 3))
        points[:, way] = along
        points[:, side] = out * np.cos(angle) + x + 1.5 * radius * (bundle // 2 - bundles // 4)
        points[:, 2] = out * np.sin(angle) + y + way * radius + along**2 / 500
        yield points


def tressfx(path):
    """Version 3: numbers of fibers and of points of each at byte 4, where points begin at 144."""
    fibers, points = np.fromfile(path, np.uint32, 2, offset=4)
    begin = np.fromfile(path, np.uint32, 1, offset=144)[0]
    return np.fromfile(path, np.float32, 3 * fibers * points, offset=begin).reshape(-1, points, 3)


def write(folder, name, fibers):
    with open(Path(folder) / f"{name}.txt", "w", encoding="ascii") as file:
        for points in fibers:
            np.savetxt(file, points, fmt="%.9g", footer="\n", comments="")


def write_mesh(folder, name, points, faces):
    with open(Path(folder) / f"{name}.obj", "w", encoding="ascii") as file:
        np.savetxt(file, points, fmt="v %.7g %.7g %.7g")
        file.writelines("f " + " ".join(str(i + 1) for i in face) + "\n" for face in faces)


def write_swc(folder, name, samples):
    with open(Path(folder) / f"{name}.swc", "w", encoding="ascii") as file:
        for i, (*numbers, parent) in enumerate(samples):
            x, y, z, radius = numbers
            before = -1 if parent < 0 else parent + 1
            file.write(f"{i + 1} 3 {x:.4f} {y:.4f} {z:.4f} {radius:.4f} {before}\n")


def main():
    folder, *data = sys.argv[1:]
    write_mesh(folder, "head", *head())
    write_mesh(folder, "arm", *arm())
    write(folder, "cables", cables())
    write_swc(folder, "neuron", neuron())
    write(folder, "tract", tract())
    write(folder, "parting", parting())
    write(folder, "knot", knot())
    write(folder, "tube", tube())
    if data:
        parts = sorted(Path(data[0]).glob("tressfx31_ponytail_*.tfx"))
        write(folder, "ponytail", [points for part in parts for points in tressfx(part)])


if __name__ == "__main__":
    main()
