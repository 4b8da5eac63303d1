#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Pairs of streamlines that overlap as tubes, with the number and the depth of their contacts.

    pairs_to_csv.py FILE RADIUS >pairs.csv

FILE is a .tck or .trk, or any other file that fcl_fibers.read knows.
"""

import sys

import numpy as np

import fcl_fibers

path, radius = sys.argv[1:]
fibers = fcl_fibers.read(path, radius=float(radius))
# [pairs]
tree = fcl_fibers.FiberTree(threads=2)
# Two streamlines of one group do not meet. Each is one of its own, so that none meets itself.
tree.build(*fibers, groups=1 + np.arange(len(fibers.offsets) - 1))
contacts = tree.contacts(order="fibers")
pairs = fcl_fibers.fiber_pairs(contacts)
depth = -contacts["distance"][pairs["deepest"]]
table = np.column_stack([pairs["fiber_a"], pairs["fiber_b"], pairs["count"], depth])
np.savetxt(sys.stdout, table, "%d,%d,%d,%.6g", header="fiber_a,fiber_b,count,depth", comments="")
# [pairs]
