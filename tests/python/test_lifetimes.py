# SPDX-License-Identifier: BSD-3-Clause
"""What is copied and what is kept, who owns results, and that nothing leaks."""

import gc
import os
import re
import resource
import subprocess
import sys
import tracemalloc
import weakref

import numpy as np
import pytest

import fcl_fibers
from conftest import LONG
from scenes import cross, random_scene, tetrahedron


def tree_of_two(points, offsets, radii=0.25):
    tree = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=0)
    tree.build(points, offsets, radii)
    return tree


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_points_are_read_where_they_are(dtype):
    points, offsets = cross(gap=1.0)
    points = points.astype(dtype)
    tree = tree_of_two(points, offsets)
    assert len(tree.contacts()) == 0
    points[2:, 2] = 0.25
    tree.update(points)
    assert tree.contacts()["distance"].tolist() == [-0.25]
    # contacts() reads them again, and pairs() does not.
    points[2:, 2] = 0.375
    assert tree.contacts()["distance"].tolist() == [-0.125]


LAYOUTS = {
    "Fortran order": np.asfortranarray,
    "negative strides": lambda p: p[::-1].copy()[::-1],
    "a slice": lambda p: np.repeat(p, 2, axis=1)[:, ::2],
}
COPIED = {
    "int32": lambda p: p.astype(np.int32),
    "float16": lambda p: p.astype(np.float16),
    "big endian": lambda p: p.astype(">f8"),
}


@pytest.mark.parametrize("layout", [*LAYOUTS, *COPIED])
def test_points_of_other_types_are_copied(layout):
    points, offsets = cross()
    points = {**LAYOUTS, **COPIED}[layout](points)
    tree = tree_of_two(points, offsets)
    points[2:, 2] = 5
    assert tree.contacts()["distance"].tolist() == [4.5 if layout in LAYOUTS else -0.5]


def test_views_and_subclasses_are_read_where_they_are():
    points, offsets = cross()
    whole = np.concatenate([np.ones((5, 3)), points])

    class Marked(np.ndarray):
        pass

    for view in (whole[5:], whole[5:].view(Marked), np.frombuffer(whole.data, float)[15:]):
        tree = tree_of_two(view.reshape(-1, 3), offsets)
        whole[7:, 2] = 0.25
        assert tree.contacts()["distance"].tolist() == [-0.25]
        whole[7:, 2] = 0


def test_radii_of_the_type_of_points_are_read_where_they_are():
    points, offsets = cross()
    for radii in (np.array([0.25, 0.25]), np.array(0.25)):
        tree = tree_of_two(points, offsets, radii)
        assert np.shares_memory(tree._tree.numbers.radii, radii)
    tree = tree_of_two(points.astype(np.float32), offsets, np.array([0.25, 0.25]))
    assert tree._tree.numbers.radii.dtype == np.float32


def test_offsets_and_rules_are_copied():
    points, offsets = cross()
    groups = np.array([1, 2], np.int32)
    tree = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=0)
    tree.build(points, offsets, 0.25, groups=groups)
    groups[:], offsets[:] = 1, [0, 4, 4]
    assert len(tree.pairs()) == 1 and tree.contacts()["fiber_b"].tolist() == [1]
    tree.update(points)
    assert len(tree.pairs()) == 1
    tree.update([points[:2], points[2:]])


def test_builds_and_updates_of_plain_arrays_take_no_memory():
    points = np.zeros((200_000, 3))
    points[:, 0] = np.arange(200_000)
    offsets, radii = np.arange(0, 200_001, 10), np.full(200_000, 0.1)
    tree = fcl_fibers.FiberTree(report="volumes", ignored_neighbors=0)
    for call in (lambda: tree.build(points, offsets, radii), lambda: tree.update(points)):
        tracemalloc.start()
        call()
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        # Segments are counted by flags of one byte.
        assert peak < points.nbytes / 4


CALLS = [
    lambda tree: tree.pairs(),
    lambda tree: tree.contacts(),
    lambda tree: tree.moving_pairs(),
    lambda tree: tree.impacts(),
    lambda tree: tree.impact_contacts(tree.impacts()),
    lambda tree: tree.pairs(fcl_fibers.BoxShape((0, 0, 0), (1, 1, 1))),
    lambda tree: tree.fiber_segment(tree.pairs()),
    lambda tree: tree.volumes(3).center,
    lambda tree: tree.volumes(3).segments,
]


def test_results_outlive_the_tree_and_may_be_written_to():
    scene = random_scene(1)
    tree = tree_of_two(scene.points, scene.offsets, scene.radii)
    tree.update(scene.points, scene.points)
    results = [call(tree) for call in CALLS]
    expected = [result.copy() for result in results]
    for result in results:
        assert len(result) > 5 and result.flags.writeable and result.flags.c_contiguous
        owner = result if result.base is None else result.base
        while isinstance(owner, np.ndarray) and owner.base is not None:
            owner = owner.base
        assert type(owner).__name__ == "PyCapsule"
        assert not np.shares_memory(result, tree._tree.numbers.radii)
    for call, result, copy in zip(CALLS, results, expected):
        result.view(np.uint8)[...] = 77
        assert (call(tree) == copy).all()
    results = [call(tree) for call in CALLS]
    del tree
    gc.collect()
    [np.full(1000, 7.0) for _ in range(1000)]
    for result, copy in zip(results, expected):
        assert (result == copy).all()


def test_inputs_may_be_dropped():
    scene = random_scene(2)
    expected = tree_of_two(scene.points, scene.offsets, scene.radii).contacts()
    points, offsets, radii = scene.points.copy(), scene.offsets.copy(), scene.radii.copy()
    tree = tree_of_two(points, offsets, radii)
    kept = weakref.ref(points)
    del points, offsets, radii
    gc.collect()
    [np.full(len(scene.points) * 3, 7.0) for _ in range(100)]
    assert kept() is not None and (tree.contacts() == expected).all()
    tree.build([], radii=1)
    gc.collect()
    assert kept() is None


def test_meshes_copy_their_arrays():
    corners, triangles = tetrahedron()
    mesh = fcl_fibers.TriangleMesh(corners, triangles, solid=True)
    tree = tree_of_two(np.array([(0.1, 0.1, 0.1), (0.2, 0.2, 0.2)]), [0, 2], 0.01)
    expected = tree.pairs(mesh)
    kept = weakref.ref(corners)
    corners += 100
    triangles[:] = 0
    assert (tree.pairs(mesh) == expected).all() and len(expected) == 1
    del corners
    assert kept() is None
    mesh.update(tetrahedron()[0])
    assert (tree.pairs(mesh) == expected).all()


def everything(tree, points, offsets, radii):
    tree.build(points, offsets, radii)
    tree.update(points, points, radii, radii)
    tree.impact_contacts(tree.impacts())
    tree.update(points)
    tree.contacts()
    tree.visit_pairs(lambda pairs: None, block=10)
    for wrong in (dict(points=points[:-1]), dict(points=points, radii=-1.0)):
        with pytest.raises(ValueError):
            tree.update(**wrong)
    with pytest.raises(ZeroDivisionError):
        tree.visit_pairs(lambda pairs: 1 / 0)
    mesh = fcl_fibers.TriangleMesh(points[:3], [[0, 1, 2]])
    tree.contacts(mesh.copy())
    tree.pairs(mesh)
    mesh.update(points[:3] + 1)
    fcl_fibers.show(points[:9], [0, 9], 0.1, meshes=[mesh])
    tree.volumes(2)


def test_reference_counts_return():
    scene = random_scene(3)
    arrays = scene.points, scene.offsets, scene.radii
    before = [sys.getrefcount(array) for array in arrays]
    tree = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=0)
    for _ in range(5):
        everything(tree, *arrays)
    del tree
    gc.collect()
    assert [sys.getrefcount(array) for array in arrays] == before


def test_memory_does_not_grow():
    scene = random_scene(4, fibers=200)

    def turns(count):
        for _ in range(count):
            everything(
                fcl_fibers.FiberTree(report="capsules", ignored_neighbors=0),
                scene.points,
                scene.offsets,
                scene.radii,
            )
        gc.collect()
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024

    # One leaked array of points would add 20 kB at each turn, and the results far more.
    first = turns(20)
    assert turns(1000 if LONG else 150) - first < 2_000_000


OUT_OF_MEMORY = """
import resource
import numpy as np
import fcl_fibers

# All capsules touch, as they do if the radius is in millimetres and the points are in metres.
points = np.random.default_rng(1).random((20_000, 2, 3))
tree = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=0, threads={threads})
tree.build(points, radii=50.0)
corners = np.random.default_rng(2).random((60_000, 3))
mesh = fcl_fibers.TriangleMesh(corners, np.arange(60_000).reshape(-1, 3))
with open("/proc/self/statm") as file:
    size = int(file.read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (size + 300_000_000, resource.RLIM_INFINITY))
try:
    tree.{query}
except MemoryError as error:
    print(error)
resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
tree.build(points, radii=1e-9)
assert len(tree.pairs()) == 0
"""


# The sanitizers need more memory than there is then.
@pytest.mark.skipif("libasan" in os.environ.get("LD_PRELOAD", ""), reason="of the sanitizers")
@pytest.mark.parametrize("threads", [1, 4])
@pytest.mark.parametrize("query", ["pairs()", "contacts()", "pairs(mesh)", "contacts(mesh)"])
def test_memory_that_runs_out_tells_of_the_radius(query, threads):
    program = OUT_OF_MEMORY.format(query=query, threads=threads)
    found = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert found.returncode == 0, found.stderr
    told = re.match(r"memory has run out after (\d+) pairs were found; the radius", found.stdout)
    assert told, found.stdout
    # So many fit into what is left, and as many more than half.
    assert 1_000_000 < int(told[1]) < 40_000_000
