# SPDX-License-Identifier: BSD-3-Clause
"""Collisions among thousands of fibers: hair, cables, ropes, yarn, streamlines, neurons.

A fiber is a polyline, and each of its segments a capsule. Three lines lead to contacts:

    tree = fcl_fibers.FiberTree()
    tree.build(points, offsets, radii)  # (n, 3), (fibers + 1,), a number
    contacts = tree.contacts()          # a structured array, one row for each pair that touches

Files are read by `read`, written by `write`, and shown in a notebook by `show`. The program
`python -m fcl_fibers` lists contacts, measures files and writes pages without any code.
"""

from . import _guard  # noqa: F401, before everything that it guards
from ._arrays import PointRadii
from ._contacts import Nodes, fiber_pairs
from ._core import version as __version__
from ._files import Fibers, FiberFileWarning, read, read_mesh, write
from ._live import LiveChanges, LiveCounters, LivePairs
from ._page import Page, show

from ._shapes import BoxShape, CapsuleShape, HalfSpaceShape, PlaneShape, Shape, SphereShape
from ._tree import FiberTree, Options, TriangleMesh, Volumes, flat, root_segments

__all__ = [
    "BoxShape",
    "CapsuleShape",
    "FiberFileWarning",
    "FiberTree",
    "Fibers",
    "HalfSpaceShape",
    "LiveChanges",
    "LiveCounters",
    "LivePairs",
    "Nodes",
    "Options",
    "Page",
    "PlaneShape",
    "PointRadii",
    "Shape",
    "SphereShape",
    "TriangleMesh",
    "Volumes",
    "__version__",
    "fiber_pairs",
    "flat",
    "read",
    "read_mesh",
    "root_segments",
    "show",
    "write",
]
