#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Makes a bundle of fibers free of collisions by pushing apart what overlaps.

    packing.py [--picture FILE]    draws the bundle before and after, with Matplotlib

240 fibers are twisted to a narrow waist, where they pass through each other. Lengths are in radii
of a fiber.
"""

import argparse

import numpy as np

import fcl_fibers

FIBERS, SEGMENTS, LENGTH = 240, 60, 180.0
NODES = SEGMENTS + 1
END, TWIST, DISORDER = 40.0, 2.1, 4.0  # radius of the bundle's ends; angle between them
GAP = 0.1  # that pushes aim at. With none, the last contacts would fade away but never end.


def bundle(seed):
    """Nodes (fibers, n, 3) of straight fibers between two disks, twisted like an hourglass."""
    random = np.random.RandomState(seed)
    # The angle between the seeds of a sunflower spreads the ends evenly over the disk. With the
    # same twist for all, the fibers would not meet. Disorder makes them pass through each other.
    distance = END * np.sqrt((np.arange(FIBERS) + 0.5) / FIBERS)
    angle = np.pi * (1 + 5**0.5) * np.arange(FIBERS)
    ends = [(distance * [np.cos(a), np.sin(a)]).T for a in (angle, angle + TWIST)]
    along = np.linspace(0, 1, NODES)[:, np.newaxis]
    low, high = (e[:, np.newaxis] + DISORDER * random.randn(FIBERS, 1, 2) for e in ends)
    height = np.broadcast_to(LENGTH * (along - 0.5), (FIBERS, NODES, 1))
    return np.concatenate([low * (1 - along) + high * along, height], axis=2)


def pushed(tree, nodes, contacts):
    """The nodes after each contact has moved the four at its ends."""
    ends, weights = tree.nodes(contacts)
    # Divided by the sum of the squared weights, a push moves the two sides apart by all of the way.
    push = (GAP - contacts["distance"]) / np.sum(weights**2, axis=1)
    # A node in many contacts moves by their mean, as their sum would overshoot. Half as much again
    # is still stable, and takes fewer rounds.
    total = tree.accumulate(contacts, push).reshape(nodes.shape)
    number = np.bincount(ends.ravel(), minlength=FIBERS * NODES).reshape(FIBERS, NODES, 1)
    return nodes + 1.5 * total / np.maximum(number, 1)


def relax(nodes, lengths):
    """Smooths the fibers a little, and brings their segments nearer to their lengths."""
    nodes[:, 1:-1] += 0.02 * np.diff(nodes, 2, axis=1)
    for start in (0, 1, 0, 1):  # every second segment, as neighbours share a node
        first, last = nodes[:, start:-1:2], nodes[:, start + 1 :: 2]
        move = (0.25 * (1 - lengths / norms(nodes))[:, start::2])[..., np.newaxis] * (last - first)
        first += move
        last -= move


def norms(nodes):
    return np.linalg.norm(np.diff(nodes, axis=1), axis=2)


def unpack(nodes):
    """The nodes free of collisions, and how many rounds that took."""
    lengths = norms(nodes)
    # The margin also reports what is near, so that it is kept apart before it overlaps again.
    tree = fcl_fibers.FiberTree(ignored_neighbors=2, margin=GAP, threads=2)
    tree.build(nodes, radii=1.0)
    for rounds in range(1000):
        contacts = tree.contacts()
        deepest = -contacts["distance"].min(initial=GAP)
        if deepest < 0:
            return nodes, rounds
        # The tree still holds the old nodes. pushed() makes new ones, which relax() may change. The
        # last overlaps go without it, since it opens what they close.
        nodes = pushed(tree, nodes, contacts)
        if rounds % 4 == 0 and deepest > 0.02:
            relax(nodes, lengths)
        tree.update(nodes)
    raise RuntimeError("the fibers do not fit")


def contacts_of(nodes):
    tree = fcl_fibers.FiberTree(ignored_neighbors=2)
    tree.build(nodes, radii=1.0)
    return tree.contacts()


parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
parser.add_argument("--picture", metavar="FILE")
arguments = parser.parse_args()

before = bundle(seed=3)
contacts = contacts_of(before)
print(f"{FIBERS} fibers, {len(contacts)} contacts")
print(f"the deepest overlap is {-contacts['distance'].min():.2f} radii")

after, rounds = unpack(before)
strain = np.abs(norms(after) / norms(before) - 1)
assert strain.max() < 0.1 and np.median(strain) < 0.01, "the fibers keep their lengths"
left = len(contacts_of(after))
assert left == 0
print(f"{left} contacts after {rounds} rounds")
print(f"no node has moved by more than {np.ceil(np.abs(after - before).max()):.0f} radii")

if arguments.picture:
    from packing_picture import draw

    title = f"Before: {len(contacts):,} contacts", f"After {rounds} rounds: no contacts"
    states = [(text, nodes, contacts_of(nodes)) for text, nodes in zip(title, (before, after))]
    draw(arguments.picture, states)
