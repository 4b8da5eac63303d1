# SPDX-License-Identifier: BSD-3-Clause
"""Fibers and triangle meshes, against brute force."""

import copy
import pickle

import numpy as np
import pytest

import fcl_fibers
import oracles
from scenes import ball, random_scene, tetrahedron
from test_contacts import tree_of

TURN = np.array([(0.36, 0.48, -0.8), (-0.8, 0.6, 0), (0.48, 0.64, 0.6)])
ERROR = 1e-9  # of scenes of size one: the oracle's, at axes that are not nearly parallel


def gaps(scene, corners):
    """Surface distances of all segments from all triangles (n, 3, 3)."""
    axes = oracles.segment_triangle(scene.start[:, None], scene.end[:, None], corners)
    return axes - scene.radius[:, None]


def check_mesh_pairs(pairs, scene, corners, solid=False, margin=0.0, met=True):
    """That pairs are those that touch, and each segment inside a solid once, by its nearest."""
    gap = gaps(scene, corners)
    met = np.broadcast_to(np.reshape(met, (-1, 1)), gap.shape)
    touches = gap <= margin
    expected = touches & met
    inside = oracles.inside(scene.start, corners) & ~touches.any(axis=1) & met[:, 0]
    if not solid:
        inside[:] = False
    at = np.searchsorted(scene.names, pairs[:, 0])
    within = inside[at]
    triangles = np.arange(len(corners))
    oracles.check(
        pairs[~within], scene.names, triangles, gap - margin, np.full(gap.shape, ERROR), met
    )
    assert sorted(at[within]) == np.flatnonzero(inside).tolist()
    assert gap[at, pairs[:, 1]][within] == pytest.approx(gap.min(axis=1)[at][within], abs=ERROR)
    return expected.any(axis=1) | inside


def test_read_mesh(tmp_path):
    path = tmp_path / "plate.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n")
    points, triangles = fcl_fibers.read_mesh(path)
    assert points.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert triangles.shape == (2, 3) and triangles.dtype == np.int32
    mesh = fcl_fibers.TriangleMesh(*fcl_fibers.read_mesh(str(path)))
    tree = fcl_fibers.FiberTree()
    tree.build([[(0.25, 0.5, -1), (0.25, 0.5, 1)]], radii=0.125)
    assert len(tree.touching_segments(mesh)) == 1
    path.write_text("v 0 0 0\nf 1 2 3\n")
    with pytest.raises(ValueError, match="plate.obj.*line 2"):
        fcl_fibers.read_mesh(path)
    with pytest.raises(FileNotFoundError):
        fcl_fibers.read_mesh(tmp_path / "none.obj")


def test_flat_contacts_of_a_mesh():
    tree = tree_of(random_scene(1, fibers=60, radius=0.02))
    contacts = tree.contacts(fcl_fibers.TriangleMesh(*ball(radius=0.4)))
    table = fcl_fibers.flat(contacts)
    assert len(table) > 10 and table.dtype["solid"] == bool
    assert (table["weight_2"] == contacts["weights"][:, 2]).all()


@pytest.fixture(params=[np.float32, np.float64])
def scene(request):
    return random_scene(1, fibers=60, radius=0.02, dtype=request.param)


@pytest.mark.parametrize("solid", [False, True])
@pytest.mark.parametrize("topology", ["bundle", "super_thread"])
@pytest.mark.parametrize("volumes", ["boxes", "spheres"])
def test_pairs(scene, solid, topology, volumes):
    points, triangles = ball(radius=0.4)
    for dtype in (np.float32, np.float64):
        mesh = fcl_fibers.TriangleMesh(points.astype(dtype), triangles, solid=solid)
        mesh.set_pose(TURN, (0.5, 0.4, 0.6))
        corners = (points.astype(dtype) @ TURN.T + (0.5, 0.4, 0.6))[triangles]
        for margin in (0.0, 0.03):
            tree = tree_of(scene, topology=topology, volumes=volumes, margin=margin)
            pairs = tree.pairs(mesh)
            assert pairs.dtype == np.int32 and len(pairs) > 50
            touching = check_mesh_pairs(pairs, scene, corners, solid, margin)
            found = tree.touching_segments(mesh)
            assert oracles.as_set(found) == set(scene.names[touching])
            assert oracles.as_set(found) == set(pairs[:, 0].tolist())


@pytest.mark.parametrize("threads", [1, 2])
def test_contacts(scene, threads):
    points, triangles = ball(radius=0.4)
    mesh = fcl_fibers.TriangleMesh(points, triangles)
    mesh.set_pose(np.eye(3), (0.5, 0.5, 0.5))
    corners = (points + 0.5)[triangles]
    tree = tree_of(scene, threads=threads)
    pairs, contacts = tree.pairs(mesh), tree.contacts(mesh)
    names = scene.offsets[contacts["fiber"]] + contacts["number"]
    assert (np.column_stack([names, contacts["triangle"]]) == pairs).all() and len(pairs) > 50
    at = np.searchsorted(scene.names, names)
    axis = scene.start[at] + contacts["s"][:, None] * (scene.end - scene.start)[at]
    on_mesh = np.einsum("ij,ijk->ik", contacts["weights"], corners[contacts["triangle"]])
    apart = gaps(scene, corners)[at, contacts["triangle"]] + scene.radius[at]
    assert (contacts["weights"] >= 0).all()
    assert contacts["weights"].sum(axis=1) == pytest.approx(np.ones(len(pairs)))
    assert oracles.length(axis - on_mesh) == pytest.approx(apart, abs=ERROR)
    assert contacts["point_b"] == pytest.approx(on_mesh, abs=ERROR)
    normal = contacts["normal"]
    assert oracles.length(normal) == pytest.approx(np.ones(len(pairs)))
    assert contacts["point_a"] == pytest.approx(axis + normal * scene.radius[at, None], abs=ERROR)
    apart_only = apart > 1e-6
    assert contacts["distance"][apart_only] == pytest.approx(
        (apart - scene.radius[at])[apart_only], abs=ERROR
    )
    assert not apart_only.all() and not contacts["solid"].any()


def test_contacts_with_a_solid():
    points, triangles = tetrahedron()
    mesh = fcl_fibers.TriangleMesh(points, triangles, solid=True)
    tree = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=0)
    tree.build([[(0.2, 0.2, 0.125), (0.2, 0.2, 0.125)], [(5, 5, 5), (6, 6, 6)]], radii=0.05)
    (contact,) = tree.contacts(mesh)
    assert contact["solid"] and contact["triangle"] == 0
    assert contact["distance"] == pytest.approx(-0.175)
    assert contact["normal"].tolist() == [0, 0, 1]
    surface = fcl_fibers.TriangleMesh(points, triangles)
    assert len(tree.contacts(surface)) == 0 and not surface.solid and mesh.solid


@pytest.mark.parametrize("solid", [False, True])
@pytest.mark.parametrize("distance", [0.0, 0.1, 10.0])
def test_nearest(scene, solid, distance):
    points, triangles = ball(radius=0.4)
    mesh = fcl_fibers.TriangleMesh(points, triangles, solid)
    mesh.set_pose(TURN, (0.5, 0.4, 0.6))
    gap = gaps(scene, (points @ TURN.T + (0.5, 0.4, 0.6))[triangles])
    found = tree_of(scene, margin=0.5).nearest(mesh, distance)
    least = gap.min(axis=1)
    assert set(found[:, 0].tolist()) == set(scene.names[least <= distance].tolist())
    assert len(set(found[:, 0].tolist())) == len(found)
    at = np.searchsorted(scene.names, found[:, 0])
    assert gap[at, found[:, 1]] == pytest.approx(least[at], abs=ERROR)
    tree = tree_of(scene)
    for wrong in (-1.0, np.nan):
        with pytest.raises(ValueError, match="distance"):
            tree.nearest(mesh, wrong)


def test_categories_and_roots(scene):
    points, triangles = ball(radius=0.4)
    mesh = fcl_fibers.TriangleMesh(points, triangles, solid=True)
    mesh.set_pose(np.eye(3), (0.5, 0.5, 0.5))
    assert mesh.categories == 2**32 - 1
    fibers = len(scene.offsets) - 1
    meets = np.array([0, 1, 2, 2**31])[np.arange(fibers) % 4].astype(np.uint32)
    roots = np.arange(fibers) % 3
    tree = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=0)
    tree.build(**scene.arguments, meets=meets, root_segments=roots)
    for bits in (0, 1, 3, 2**31, 2**32 - 1):
        mesh.categories = bits
        assert mesh.categories == bits
        met = ((meets & bits) != 0)[scene.fiber] & (scene.number >= roots[scene.fiber])
        pairs = tree.pairs(mesh)
        touching = check_mesh_pairs(pairs, scene, (points + 0.5)[triangles], True, met=met)
        assert oracles.as_set(tree.touching_segments(mesh)) == set(scene.names[touching])
        assert (len(pairs) > 0) == (bits != 0)
    # Fibers that meet every mesh need no bits, and pairs of fibers ignore them.
    tree.build(**scene.arguments)
    mesh.categories = 0
    assert len(tree.pairs(mesh)) > 0


def test_poses():
    points, triangles = tetrahedron()
    mesh = fcl_fibers.TriangleMesh(points, triangles)
    rotation, position = mesh.pose
    assert (rotation == np.eye(3)).all() and (position == 0).all()
    mesh.set_pose(TURN.tolist(), [1, 2, 3])
    reflection, stretched, skewed = np.diag([1.0, 1, -1]), 2 * np.eye(3), np.eye(3) + 0.1
    for wrong in (reflection, stretched, skewed, np.zeros((3, 3)), np.full((3, 3), np.nan)):
        with pytest.raises(ValueError, match="rotation"):
            mesh.set_pose(wrong, (0, 0, 0))
    for wrong, shape in ((np.eye(4), r"\(4, 4\)"), (np.eye(3).ravel(), r"\(9,\)")):
        with pytest.raises(ValueError, match=shape):
            mesh.set_pose(wrong, (0, 0, 0))
    for wrong in ((0, 0), (0, 0, np.nan), (0, 0, np.inf), 0):
        with pytest.raises(ValueError, match="position"):
            mesh.set_pose(np.eye(3), wrong)
    with pytest.raises(TypeError, match="complex"):
        mesh.set_pose(np.eye(3) * 1j, (0, 0, 0))
    rotation, position = mesh.pose
    assert (rotation == TURN).all() and position.tolist() == [1, 2, 3]
    rotation[:] = 0
    assert (mesh.pose[0] == TURN).all()


def test_copies():
    points, triangles = tetrahedron()
    mesh = fcl_fibers.TriangleMesh(points, triangles, solid=True)
    mesh.set_pose(np.eye(3), (1, 0, 0))
    mesh.categories = 5
    for same in (mesh.copy(), copy.copy(mesh)):
        assert type(same) is fcl_fibers.TriangleMesh and same.solid
        assert same.categories == 5 and same.pose[1].tolist() == [1, 0, 0]
        same.set_pose(np.eye(3), (9, 9, 9))
        same.categories = 1
        same.update(points + 100)
        assert mesh.categories == 5 and mesh.pose[1].tolist() == [1, 0, 0]
        assert same.triangle_count == mesh.triangle_count == 4 and same.point_count == 4
    tree = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=0)
    tree.build([[(1.1, 0.1, 0.1), (1.2, 0.1, 0.1)]], radii=0.01)
    assert len(tree.pairs(mesh)) == 1
    assert repr(mesh) == "<TriangleMesh: solid, 4 triangles>" and mesh.memory_usage > 0


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_update(scene, dtype):
    points, triangles = ball(radius=0.4)
    mesh = fcl_fibers.TriangleMesh(points, triangles, solid=True)
    tree = tree_of(scene)
    moved = (points * (0.5, 1.0, 1.5) + 0.5).astype(dtype)
    mesh.update(moved)
    check_mesh_pairs(tree.pairs(mesh), scene, moved.astype(float)[triangles], solid=True)
    before = tree.pairs(mesh)
    for wrong, error, word in [
        (points[:-1], ValueError, "points"),
        (-points, ValueError, "volume|inside out"),
        (np.full(points.shape, np.nan), ValueError, "point 0"),
        (points[:, :2], ValueError, r"\(62, 2\)"),
        (points * 1j, TypeError, "complex"),
    ]:
        with pytest.raises(error, match=word):
            mesh.update(wrong)
        assert (tree.pairs(mesh) == before).all()


@pytest.mark.parametrize(
    "triangles, error, word",
    [
        ([[0, 1, 4]], ValueError, "triangle 0"),
        ([[0, 1, 2], [0, -1, 2]], ValueError, "triangle 1"),
        ([[0, 1, 2**40]], ValueError, "triangles"),
        (np.array([[0, 1, 2**64 - 1]], np.uint64), ValueError, "triangles"),
        ([0, 1, 2], ValueError, r"\(3,\)"),
        ([[0, 1]], ValueError, r"\(1, 2\)"),
        (np.zeros((1, 1, 3), int), ValueError, r"\(1, 1, 3\)"),
        ([[0.0, 1.0, 2.0]], TypeError, "triangles"),
        (None, TypeError, "triangles"),
        ([["0", "1", "2"]], TypeError, "triangles"),
    ],
)
def test_wrong_triangles(triangles, error, word):
    with pytest.raises(error, match=word):
        fcl_fibers.TriangleMesh(tetrahedron()[0], triangles)


def test_wrong_meshes():
    points, triangles = tetrahedron()
    with pytest.raises(ValueError, match="watertight|edge"):
        fcl_fibers.TriangleMesh(points, triangles[:3], solid=True)
    with pytest.raises(ValueError, match="volume|inside out|clockwise"):
        fcl_fibers.TriangleMesh(points, triangles[:, ::-1], solid=True)
    with pytest.raises(ValueError, match=r"\(4, 2\)"):
        fcl_fibers.TriangleMesh(points[:, :2], triangles)
    with pytest.raises(ValueError, match="point 1"):
        fcl_fibers.TriangleMesh([[0, 0, 0], [0, np.inf, 0], [0, 0, 0]], [[0, 1, 2]])
    tree = fcl_fibers.FiberTree(report="volumes", ignored_neighbors=0)
    mesh = fcl_fibers.TriangleMesh(points, triangles)
    for call in (tree.pairs, tree.contacts, tree.touching_segments, lambda m: tree.nearest(m, 1)):
        with pytest.raises(ValueError, match="kVolumes|capsules"):
            call(mesh)


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.uint32, np.int64, np.uint64, ">i4"])
def test_types_of_triangles(dtype):
    points, triangles = tetrahedron()
    for order in (np.asarray, np.asfortranarray):
        mesh = fcl_fibers.TriangleMesh(points, order(triangles.astype(dtype)), solid=True)
        assert mesh.triangle_count == 4


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_pickled_meshes_are_equal(scene, protocol):
    points, triangles = ball(radius=0.4)
    for dtype, solid in ((np.float32, True), (np.float64, False)):
        mesh = fcl_fibers.TriangleMesh(points.astype(dtype), triangles, solid=solid)
        mesh.set_pose(TURN, (0.5, 0.4, 0.6))
        mesh.categories = 5
        other = pickle.loads(pickle.dumps(mesh, protocol))
        assert (other.solid, other.categories) == (solid, 5)
        assert all(
            (a == b).all() for a, b in zip(mesh.pose + mesh.placed(), other.pose + other.placed())
        )
        tree = tree_of(scene)
        assert len(tree.pairs(mesh)) > 0 and (tree.pairs(mesh) == tree.pairs(other)).all()
        mesh.update(points.astype(dtype) * 0.5)
        other.update(points.astype(dtype) * 0.5)
        assert (tree.pairs(mesh) == tree.pairs(other)).all()


def test_meshes_without_triangles(scene):
    mesh = fcl_fibers.TriangleMesh(np.empty((0, 3)), np.empty((0, 3), int))
    tree = tree_of(scene)
    assert tree.pairs(mesh).shape == tree.nearest(mesh, 100).shape == (0, 2)
    assert len(tree.contacts(mesh)) == len(tree.touching_segments(mesh)) == 0


def test_filters_of_both_sides():
    tree = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=1)
    mesh = fcl_fibers.TriangleMesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    fibers = [[(0.25, 0.25, -1), (0.25, 0.25, 1)]] * 4
    assert mesh.categories == mesh.meets == 2**32 - 1
    mesh.categories, mesh.meets = 6, 3
    for one in (mesh, mesh.copy(), pickle.loads(pickle.dumps(mesh))):
        assert (one.categories, one.meets) == (6, 3)
        one.update([(0, 0, 0), (1, 0, 0), (0, 1, 0)])
        for categories in ([1, 2, 4, 8], None):
            for meets in ([1, 2, 4, 8], [8, 4, 2, 1], None):
                tree.build(fibers, radii=0.1, categories=categories, meets=meets)
                expected = [
                    2 * f
                    for f in range(4)
                    if (categories is None or categories[f] & 3) and (meets is None or meets[f] & 6)
                ]
                assert tree.touching_segments(one).tolist() == expected
    with pytest.raises(ValueError, match="meets is -1"):
        mesh.meets = -1
    with pytest.raises(ValueError, match="categories are 3 for 4 fibers"):
        tree.build(fibers, radii=0.1, categories=[1, 2, 3])
