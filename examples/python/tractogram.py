#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Which streamlines of a tractogram can be tubes of a given radius without any overlap?

    tractogram.py [FILE RADIUS KEPT]

FILE is a .tck or .trk, or any other file that fcl_fibers.read knows; KEPT is the .tck to write.
Without them, the script makes bundles.tck, 10,000 streamlines of 100 segments in 10 bundles that
cross, and kept.tck. Lengths are in mm.
"""

import sys

import numpy as np

import fcl_fibers

BUNDLES, STREAMLINES, SEGMENTS, STEP = 10, 1000, 100, 1.0
BUNDLE_RADIUS, TUBE_RADIUS = 6.0, 0.05


def bundles(seed):
    """Points (streamlines, n, 3) of smooth streamlines that wander inside curved bundles."""
    # RandomState, unlike newer generators, draws the same numbers in all versions of NumPy.
    random = np.random.RandomState(seed)
    along = STEP * (np.arange(SEGMENTS + 1) - SEGMENTS / 2)
    made = []
    for bundle in range(BUNDLES):
        # Half of the bundles run along x and half along y, below the others. They only graze each
        # other: where bundles go through each other, hardly any streamline is free of overlaps.
        way, side, up = np.eye(3)[[bundle % 2, 1 - bundle % 2, 2]]
        place = 2 * BUNDLE_RADIUS * (bundle // 2 - BUNDLES / 4 + 0.5)
        bend = (1 - 2 * (bundle % 2)) * (BUNDLE_RADIUS - 1 + along**2 / 500)
        center = along[:, np.newaxis] * way + place * side + bend[:, np.newaxis] * up

        angle = 2 * np.pi * random.rand(STREAMLINES, 1)
        distance = BUNDLE_RADIUS * np.sqrt(random.rand(STREAMLINES, 1))
        wander, phase = 0.1 * random.randn(STREAMLINES, 2, 1), 6 * random.rand(STREAMLINES, 2, 1)
        x = distance * np.cos(angle) + wander[:, 0] * np.sin(along / 25 + phase[:, 0])
        y = distance * np.sin(angle) + wander[:, 1] * np.sin(along / 25 + phase[:, 1])
        made.append(center + x[..., np.newaxis] * side + y[..., np.newaxis] * up)
    return np.concatenate(made)


def overlapping(fibers):
    """The pairs of streamlines whose tubes overlap, (n, 2), each once, and how many segments do."""
    count = len(fibers.offsets) - 1
    owner = np.repeat(np.arange(count), np.diff(fibers.offsets))
    found, segment_pairs = [np.empty(0, np.int64)], 0

    def visit(pairs):
        nonlocal segment_pairs
        a, b = owner[pairs].T
        others = a != b
        segment_pairs += np.count_nonzero(others)
        # One number for each pair of streamlines lets unique() sort numbers instead of rows.
        found.append(np.unique(np.minimum(a, b)[others] * count + np.maximum(a, b)[others]))
        if len(found) > 64:
            found[:] = [np.unique(np.concatenate(found))]

    # [blocks]
    # Two streamlines that run side by side touch with dozens of segments, and a whole-brain
    # tractogram has more such pairs of segments than fit into memory: 10^9 of them take 8 GB as
    # pairs(), and contacts() needs 18 times that. visit_pairs() passes blocks of them, of which
    # only the pairs of streamlines are kept.
    tree = fcl_fibers.FiberTree(threads=2)
    tree.build(*fibers)
    tree.visit_pairs(visit, block=1 << 18)
    # [blocks]
    keys = np.unique(np.concatenate(found))
    return np.stack([keys // count, keys % count], axis=1), segment_pairs


def greedy(pairs, count):
    """A mask of streamlines no two of which are a pair; no further one could be added.

    It is what a loop finds that goes through all streamlines, those with the fewest overlaps first,
    and keeps each that overlaps none of those kept before. Here each round decides all streamlines
    at once that come before all their neighbours, so that a few rounds are enough.
    """
    overlaps = np.bincount(pairs.ravel(), minlength=count)
    rank = np.empty(count, np.int64)
    rank[np.argsort(overlaps, kind="stable")] = np.arange(count)
    kept, open_ = np.zeros(count, bool), np.ones(count, bool)
    while open_.any():
        first = np.full(count, count)
        np.minimum.at(first, pairs[:, 0], rank[pairs[:, 1]])
        np.minimum.at(first, pairs[:, 1], rank[pairs[:, 0]])
        chosen = open_ & (rank < first)
        kept |= chosen
        open_ &= ~chosen
        open_[pairs[chosen[pairs[:, 0]], 1]] = False
        open_[pairs[chosen[pairs[:, 1]], 0]] = False
        pairs = pairs[open_[pairs].all(axis=1)]
    return kept


def subset(fibers, kept):
    """The fibers of a mask, without a loop over them."""
    lengths = np.diff(fibers.offsets)
    of_kept = np.repeat(kept, lengths)
    radii = fibers.radii if np.ndim(fibers.radii) == 0 else fibers.radii[of_kept]
    closed = None if fibers.closed is None else fibers.closed[kept]
    offsets = np.concatenate([[0], np.cumsum(lengths[kept])])
    return fcl_fibers.Fibers(fibers.points[of_kept], offsets, radii, closed)


def write_tck(path, fibers):
    """In MRtrix's format: a point of NaN ends each streamline, one of infinity the file."""
    points = np.insert(fibers.points.astype("<f4"), fibers.offsets[1:], np.nan, axis=0)
    header = "mrtrix tracks\ndatatype: Float32LE\nfile: . 64\nEND\n"
    with open(path, "wb") as file:
        file.write(header.ljust(64).encode())
        file.write(np.append(points, np.full((1, 3), np.inf, "<f4"), axis=0).tobytes())


if len(sys.argv) > 1:
    path, radius, kept_path = sys.argv[1], float(sys.argv[2]), sys.argv[3]
else:
    path, radius, kept_path = "bundles.tck", TUBE_RADIUS, "kept.tck"
    points = bundles(seed=1)
    offsets = np.arange(len(points) + 1) * (SEGMENTS + 1)
    write_tck(path, fcl_fibers.Fibers(points.reshape(-1, 3), offsets, radius, None))

# [read]
fibers = fcl_fibers.read(path, radius=radius)
# [read]
count = len(fibers.offsets) - 1
print(f"{count} streamlines, {len(fibers.points) - count} segments")
pairs, segment_pairs = overlapping(fibers)
print(f"{segment_pairs} pairs of segments overlap, of {len(pairs)} pairs of streamlines")
print(f"{len(np.unique(pairs))} streamlines overlap others")

kept = greedy(pairs, count)
print(f"{np.count_nonzero(kept)} streamlines are kept")
kept_fibers = subset(fibers, kept)
write_tck(kept_path, kept_fibers)
# A second query tells whether that is right: it knows nothing of the first.
rest, _ = overlapping(kept_fibers)
assert len(rest) == 0
print(f"{len(rest)} pairs of those overlap")
