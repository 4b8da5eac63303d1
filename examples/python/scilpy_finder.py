# SPDX-License-Identifier: BSD-3-Clause
"""Collisions in a tractogram as scilpy finds them, by one query instead of one for each segment.

    pip install scilpy
    python examples/python/scilpy_finder.py

It filters the same streamlines as scilpy's own class, because it goes through the segments in the
same order.
"""

import sys
import time

import numpy as np
from dipy.io.stateful_tractogram import Space, StatefulTractogram
from nibabel import Nifti1Image
from scilpy.tractograms.intersection_finder import IntersectionFinder

import fcl_fibers


# [finder]
class TreeIntersectionFinder(IntersectionFinder):
    def find_intersections(self, min_distance=0):
        count, segments = len(self.streamlines), self.seg_indices
        tree = fcl_fibers.FiberTree(margin=min_distance)
        own = np.arange(1, count + 1)  # of one group, so that a streamline does not meet itself
        tree.build(list(self.streamlines), radii=np.array(self.diameters) / 2, groups=own)
        order = np.empty(len(tree.points), int)  # in which scilpy goes through the segments
        order[tree.offsets[segments[:, 0]] + segments[:, 1]] = np.arange(len(segments))
        c = tree.contacts()
        c = c[c["distance"] < min_distance]
        one, two = np.append(c["fiber_a"], c["fiber_b"]), np.append(c["fiber_b"], c["fiber_a"])
        self._invalid, self._obstacle, self._excluded = np.zeros((3, count), bool)
        self._collisions = np.zeros((count, 3), np.float32)
        for i in np.argsort(np.append(order[c["a"]], order[c["b"]]), kind="stable"):
            if not (self._invalid | self._excluded)[[one[i], two[i]]].any():
                contact = c[i % len(c)]
                hits = contact["distance"] < 0
                (self._invalid if hits else self._excluded)[one[i]] = True
                self._obstacle[two[i]] |= hits
                self._collisions[one[i]] = hits * (contact["point_a"] + contact["point_b"]) / 2


# [finder]


def tractogram(count, points, step, seed=1):
    """Streamlines along z, one to a square millimetre."""
    rng = np.random.default_rng(seed)
    steps = np.array([0, 0, 1]) + 0.15 * rng.normal(size=(count, points, 3))
    steps *= step / np.linalg.norm(steps, axis=2, keepdims=True)
    steps[:, 0, :2] = rng.uniform(0, np.sqrt(count), (count, 2))
    lines = np.cumsum(steps, axis=1).astype(np.float32)
    image = Nifti1Image(np.zeros((100, 100, 100)), np.eye(4))
    return StatefulTractogram(list(lines), image, Space.RASMM)


def found_by(finder, tracts, min_distance):
    finder = finder(tracts, np.full(len(tracts), 0.05))
    begin = time.process_time()
    finder.find_intersections(min_distance)
    seconds = time.process_time() - begin
    return finder.invalid | finder.excluded, finder.invalid, seconds


bundle = tractogram(2000, 20, 1.0)
found_by(IntersectionFinder, bundle[:10], 0)  # Numba compiles
for distance in (0, 0.02):
    theirs, theirs_hit, before = found_by(IntersectionFinder, bundle, distance)
    ours, ours_hit, after = found_by(TreeIntersectionFinder, bundle, distance)
    print(f"distance {distance}: {ours.sum()} of {len(ours)} streamlines are filtered")
    print(f"processor time: {before:.2f} s by scilpy, {after:.3f} s by a tree", file=sys.stderr)
    assert (ours == theirs).all() and (distance > 0 or (ours_hit == theirs_hit).all())
