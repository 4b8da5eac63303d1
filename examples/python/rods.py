#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The contact loop of a rod simulation in NumPy: a pile of 1,000 elastic rods under a press.

20 layers of 50 rods lie crosswise on each other. The lowest layer is clamped, and a plate presses
the highest one down and to the side. Friction carries the push from layer to layer.

    rods.py [--times]    --times also tells where the time goes

Lengths are in mm, masses in g and times in ms, so that forces are in N.
"""

import sys
import time

import numpy as np

import fcl_fibers

LAYERS, RODS, ELEMENTS, STEPS = 20, 50, 100, 100
NODES = ELEMENTS + 1
RADIUS, LENGTH, GAP = 1.0, 4.0, 0.005  # of a rod, of an element, between two layers
AREA, DENSITY, YOUNG = np.pi * RADIUS**2, 1e-3, 10.0
STRETCH = YOUNG * AREA / LENGTH
BEND = YOUNG * np.pi / 4 * RADIUS**4 / LENGTH**3
MASS = DENSITY * AREA * LENGTH  # of a node
CONTACT, DASHPOT, FRICTION, SLIP = 20.0, 0.1, 0.3, 0.2
PRESS = np.array([0.02, 0.0, -0.1])  # on each node of the highest layer
DT = 0.015  # from 0.04 on, the stretch springs would be unstable


def pile():
    """The nodes, (rods, nodes, 3)."""
    along = LENGTH * np.arange(NODES)
    # A rod crosses the middle of an element, where the two capsules make one contact. Above a node
    # there would be up to four for the same crossing.
    beside = LENGTH * (2 * np.arange(RODS) + 0.5)
    nodes = np.zeros((LAYERS, RODS, NODES, 3))
    for layer in range(LAYERS):
        nodes[layer, :, :, layer % 2] = along
        nodes[layer, :, :, 1 - layer % 2] = beside[:, np.newaxis]
        nodes[layer, :, :, 2] = layer * (2 * RADIUS + GAP)
    return nodes.reshape(-1, NODES, 3)


def rod_forces(nodes):
    """Forces of the stretch and bending springs on the nodes, and their energy."""
    forces = np.zeros_like(nodes)
    edges = np.diff(nodes, axis=1)
    lengths = np.sqrt(np.einsum("rnc,rnc->rn", edges, edges))
    tension = (STRETCH * (1 - LENGTH / lengths))[..., np.newaxis] * edges
    forces[:, :-1] += tension
    forces[:, 1:] -= tension
    # Three nodes in a row resist to be out of line. The rods are straight at rest.
    bow = np.diff(edges, axis=1)
    forces[:, :-2] -= BEND * bow
    forces[:, 1:-1] += 2 * BEND * bow
    forces[:, 2:] -= BEND * bow
    energy = STRETCH * np.sum((lengths - LENGTH) ** 2) + BEND * np.sum(bow**2)
    return forces, energy / 2


def contact_forces(tree, contacts, speeds):
    """Forces of the contacts on the nodes, (n, 3), and their energy."""
    # The ends of a's element and then those of b's, and which part of the contact each takes.
    ends, weights = tree.nodes(contacts)
    normal, depth = contacts["normal"], -contacts["distance"]

    # How b moves relative to a at the contact. The normal points from a to b, so that they part if
    # the first number is positive. The dashpot only slows an approach: contacts never pull.
    motion = np.einsum("nk,nkc->nc", weights * [-1, -1, 1, 1], speeds[ends])
    parting = np.einsum("nc,nc->n", motion, normal)
    pressure = CONTACT * depth + DASHPOT * np.maximum(-parting, 0)
    # Coulomb's friction jumps where the slip changes its sign. Below the speed SLIP it is smooth.
    slip = motion - parting[:, np.newaxis] * normal
    slip_speed = np.sqrt(np.einsum("nc,nc->n", slip, slip) + SLIP**2)
    drag = FRICTION * pressure / slip_speed
    on_b = pressure[:, np.newaxis] * normal - drag[:, np.newaxis] * slip

    # Each force is shared between the ends of its element by the lever rule, and the other element
    # takes the same with the opposite sign.
    pushes = tree.accumulate(contacts, on_b)
    return pushes, CONTACT / 2 * np.sum(depth**2)


nodes = pile()
speeds = np.zeros_like(nodes)
clamped = slice(0, RODS)
pressed = slice(-RODS, None)

# [tree]
# Adjacent elements of a rod always touch. Leaving them out here is faster than to do it in NumPy.
tree = fcl_fibers.FiberTree(threads=2)
tree.build(nodes, radii=RADIUS)  # once: the rods keep their numbers of nodes
# No node moves further than 0.06 radii in a step, so the pairs that touch are among those that were
# near before.
live = fcl_fibers.LivePairs(tree)
# [tree]
print(f"{tree.fiber_count} rods, {tree.segment_count} elements, {len(tree.contacts())} contacts")

work = deepest = 0.0
seconds = {"update": 0.0, "contacts": 0.0, "forces of contacts": 0.0, "rods": 0.0}
for step in range(1, STEPS + 1):
    clock = [time.perf_counter()]
    # [step]
    tree.update(nodes)
    live.update()
    clock.append(time.perf_counter())
    contacts = live.contacts()
    clock.append(time.perf_counter())
    pushes, contact_energy = contact_forces(tree, contacts, speeds.reshape(-1, 3))
    # [step]
    clock.append(time.perf_counter())
    forces, rod_energy = rod_forces(nodes)

    # Action and reaction: what is inside the pile cannot move it as a whole.
    for inner in (pushes, forces):
        assert np.abs(inner.sum(axis=(0, 1) if inner.ndim == 3 else 0)).max() < 1e-9
    energy = MASS / 2 * np.sum(speeds**2) + rod_energy + contact_energy
    assert energy <= 1.02 * work + 1e-9, "the pile has more energy than the press has given it"
    deepest = max(deepest, -contacts["distance"].min(initial=0))

    # Semi-implicit Euler: the nodes move with the new speeds. The tree has read the nodes where
    # they are, so that they go to a new array instead of being changed in place.
    forces += pushes.reshape(forces.shape)
    forces[pressed] += PRESS
    speeds += DT / MASS * forces
    speeds[clamped] = 0
    nodes = nodes + DT * speeds
    work += DT * np.sum(speeds[pressed] * PRESS)
    clock.append(time.perf_counter())
    for what, start, end in zip(seconds, clock, clock[1:]):
        seconds[what] += end - start

tree.update(nodes)
contacts = tree.contacts()
assert deepest < 0.05 * RADIUS
assert np.all(contacts["fiber_a"] // RODS != contacts["fiber_b"] // RODS)
layers = nodes.reshape(LAYERS, -1, 3).mean(axis=1) - pile().reshape(LAYERS, -1, 3).mean(axis=1)
assert np.all(layers[LAYERS // 2 :, 0] > 0), "friction drags the layers along"
print(f"{len(contacts)} contacts after {STEPS} steps")
print(f"the highest layer has sunk by {-layers[-1, 2]:.2f} mm and moved by {layers[-1, 0]:.2f} mm")
print(f"the deepest overlap was {100 * deepest / RADIUS:.1f} % of the radius")
if "--times" in sys.argv:
    total = sum(seconds.values())
    for what, value in seconds.items():
        print(f"{what:20} {1e3 * value / STEPS:6.2f} ms a step, {100 * value / total:3.0f} %")
