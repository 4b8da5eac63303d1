#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Where a neuron touches itself, and where two come within 2 micrometres of each other.

    neurons.py [ONE.swc OTHER.swc]

Without files, the script makes two neurons. Lengths are in micrometres.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

import fcl_fibers

NEAR = 2.0


def make_neuron(path, soma, seed):
    """Writes a neuron of eight stems, which wander, taper and branch, as .swc."""
    # RandomState, unlike newer generators, draws the same numbers in all versions of NumPy.
    random = np.random.RandomState(seed)
    samples = [(*soma, 5.0, -1)]  # x, y, z, radius, parent
    tips = [(0, way / np.linalg.norm(way)) for way in random.randn(8, 3)]
    for step in range(60):
        grown = []
        for parent, way in tips:
            way = way + 0.3 * random.randn(3)
            way /= np.linalg.norm(way)
            radius = 0.8 * 0.985**step * random.uniform(0.5, 1.5)
            samples.append((*(samples[parent][:3] + 2 * way), radius, parent))
            ways = [way, way + random.randn(3)] if random.rand() < 0.03 else [way]
            grown += [(len(samples) - 1, w / np.linalg.norm(w)) for w in ways]
        tips = grown
    lines = [
        f"{i + 1} 3 {x:.3f} {y:.3f} {z:.3f} {r:.4f} {parent + 1 if i else -1}"
        for i, (x, y, z, r, parent) in enumerate(samples)
    ]
    path.write_text("\n".join(lines) + "\n")


def read(path):
    # A fiber runs from a root or a branching point to the next one, or to a tip.
    fibers = fcl_fibers.read(path)
    print(f"{Path(path).name}: {len(fibers.offsets) - 1} fibers, {len(fibers.points)} points")
    return fibers


with tempfile.TemporaryDirectory() as folder:
    paths = sys.argv[1:3]
    if not paths:
        paths = [Path(folder, "one.swc"), Path(folder, "other.swc")]
        make_neuron(paths[0], (0, 0, 0), seed=1)
        make_neuron(paths[1], (60, 0, 0), seed=2)
    one, other = map(read, paths)

# [one]
# The stems leave a soma of radius 5 side by side, so what is near along the neuron is left out.
tree = fcl_fibers.FiberTree(ignored_arc_length=16)
tree.build(one)  # with its radii at points, and where its branches begin
contacts = tree.contacts(order="segments")
print(f"{len(contacts)} pairs of segments of one.swc touch")
for contact in contacts[np.argsort(contacts["distance"])][:3]:
    # A sample of the file is the second end of a segment.
    a, b = (one.samples[contact[side] + 1] for side in ("a", "b"))
    print(f"samples {a} and {b}: {-contact['distance']:.3f} deep")
# [one]

# [less]
tree.build(*one)
print(f"{len(tree.pairs())} if the branches are left out")
thick = np.append(np.maximum(one.radii[:-1], one.radii[1:]), 0)  # PointRadii, as one.radii are
thick = np.asarray(thick)  # of the segment that starts at each point
tree.build(one.points, one.offsets, thick, starts_at=one.starts_at)
print(f"{len(tree.pairs())} if the tapers are")
# [less]

# [places]
tree, partner = fcl_fibers.FiberTree(margin=NEAR), fcl_fibers.FiberTree()
tree.build(one)
partner.build(other)
contacts = tree.contacts(partner, order="fibers")
pairs = fcl_fibers.fiber_pairs(contacts)
print(f"{len(pairs)} pairs of fibers come within {NEAR} of each other")
for pair in pairs[np.argsort(contacts["distance"][pairs["deepest"]])][:5]:
    nearest = contacts[pair["deepest"]]
    x, y, z = nearest["point_a"]
    print(
        f"fibers {pair['fiber_a']} and {pair['fiber_b']}: {pair['count']} pairs of segments; "
        f"the least distance is {nearest['distance']:.2f} at ({x:.1f}, {y:.1f}, {z:.1f})"
    )
# [places]
