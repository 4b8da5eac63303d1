# SPDX-License-Identifier: BSD-3-Clause
"""Wrong arrays are refused by an error that names them, and the tree keeps its answers."""

import re

import numpy as np
import pytest

import fcl_fibers
from scenes import random_scene

GOOD = dict(points=np.eye(4, 3), offsets=np.array([0, 2, 4]), radii=0.5)
FIBERS = dict(points=np.eye(4, 3).reshape(2, 2, 3), radii=0.5)


def with_number(number, dtype=float):
    points = np.eye(4, 3).astype(dtype)
    points[2, 1] = number
    return points


@pytest.fixture
def tree():
    scene = random_scene(1)
    tree = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=0)
    tree.build(**scene.arguments)
    before, fibers, numbers = tree.contacts(), tree.fiber_count, tree._tree.numbers.radii
    yield tree
    assert (tree.contacts() == before).all() and tree.fiber_count == fibers
    assert tree._tree.numbers.radii is numbers
    # The next update fits the fibers of the last build.
    tree.update(scene.points)
    assert (tree.contacts() == before).all()


def refused(call, error, *words, **arguments):
    with pytest.raises(error) as raised:
        call(**arguments)
    text = str(raised.value)
    assert all(word in text for word in words), text
    assert "incompatible function arguments" not in text, text


@pytest.mark.parametrize(
    "points, error, word",
    [
        (np.zeros((4, 2)), ValueError, "(4, 2)"),
        (np.zeros((3, 4)), ValueError, "(3, 4)"),
        (np.zeros(12), ValueError, "(12,)"),
        (np.zeros((2, 2, 3)), ValueError, "(2, 2, 3)"),
        (np.array(1.0), ValueError, "()"),
        (1.0, ValueError, "()"),
        (np.zeros((4, 3), complex), TypeError, "complex"),
        (np.array([["1"] * 3] * 4), TypeError, "points"),
        (np.zeros((4, 3), object), TypeError, "object"),
        (np.zeros((4, 3), "M8[s]"), TypeError, "points"),
        (np.zeros((4, 3), bool), TypeError, "bool"),
        (None, TypeError, "points"),
        ("points", TypeError, "points"),
        ([[0, 0, 0], [1, 2]], (TypeError, ValueError), ""),
        (with_number(np.nan), ValueError, "point 2"),
        (with_number(np.inf), ValueError, "point 2"),
        (with_number(-np.inf, np.float32), ValueError, "point 2"),
        (with_number(np.nan, np.float32), ValueError, "point 2"),
    ],
)
def test_points(tree, points, error, word):
    refused(tree.build, error, word, **{**GOOD, "points": points})


@pytest.mark.parametrize(
    "points, error, word",
    [
        (np.zeros((2, 2, 2)), ValueError, "(2, 2, 2)"),
        (np.zeros((4, 3)), TypeError, "offsets are missing"),  # a forgotten argument, not one fiber
        (np.zeros((2, 2, 2, 3)), ValueError, "(2, 2, 2, 3)"),
        (np.array(1.0), ValueError, "()"),
        ([np.zeros((2, 3)), np.zeros((2, 2))], ValueError, "fiber 1"),
        ([np.zeros((2, 3)), np.zeros(3)], ValueError, "fiber 1"),
        ([[0, 0, 0], [1, 1, 1]], ValueError, "fiber 0"),
        ([1, 2], ValueError, "fiber 0"),
        (None, TypeError, "points"),
        (1.0, TypeError, "points"),
        ("abc", (TypeError, ValueError), "points"),
        ([np.zeros((0, 3), complex)], TypeError, "complex"),
        (np.ma.masked_equal(np.zeros((1, 2, 3)), 0), TypeError, "masked"),
        (np.array([np.zeros((2, 3)), None], object), TypeError, "points"),
    ],
)
def test_points_without_offsets(tree, points, error, word):
    refused(tree.build, error, word, points=points, radii=0.5)


@pytest.mark.parametrize(
    "offsets, error, word",
    [
        ([], ValueError, "empty"),
        (0, TypeError, "a radius by name: radius=0"),
        (0.1, TypeError, "the number 0.1 is in the place of offsets"),
        ([0.1, 0.2], TypeError, "radii by name"),
        ([[0, 4, 4]], ValueError, "(1, 3)"),
        ([[0, 5]], ValueError, "fiber 0 has the offsets [0, 5]"),
        ([[2, 1]], ValueError, "from 0 to 4"),
        ([1, 4], ValueError, "from 1 to 4"),
        ([0, 3], ValueError, "from 0 to 3"),
        ([0, 5], ValueError, "from 0 to 5"),
        ([0, 3, 2, 4], ValueError, "fiber 1"),
        ([0, -1, 4], ValueError, "fiber 0"),
        ([0, 2**62, 4], ValueError, "fiber 1"),
        (np.array([0, 2**63, 4], np.uint64), ValueError, "offsets"),
        (np.array([0, 2**64 - 1], np.uint64), ValueError, "offsets"),
        ([0.0, 4.0], TypeError, "offsets"),
        (["0", "4"], TypeError, "offsets"),
        ([0, None], TypeError, "offsets"),
        (np.array([0, 4], complex), TypeError, "offsets"),
        ([0, 10**30], (TypeError, ValueError), "offsets"),
    ],
)
def test_offsets(tree, offsets, error, word):
    refused(tree.build, error, word, **{**GOOD, "offsets": offsets})


@pytest.mark.parametrize(
    "radii, error, word",
    [
        (None, TypeError, "radii are missing"),
        (-1.0, ValueError, "the radius is negative"),
        (np.nan, ValueError, "the radius is negative, NaN"),
        (np.inf, ValueError, "the radius is negative, NaN or infinite"),
        ([0.1, -0.1], ValueError, "radius 1 is"),
        ([0.1, 0.1, np.nan, 0.1], ValueError, "radius 2 is"),
        ([], ValueError, "0 radii"),
        ([1.0], ValueError, "1 radii"),
        (np.zeros(3), ValueError, "3 radii"),
        (np.zeros(5), ValueError, "5 radii"),
        (1j, TypeError, "complex"),
        ("1", TypeError, "radii"),
        (["1", "2"], TypeError, "radii"),
        (object(), TypeError, "object"),
        ([None, 1.0], TypeError, "radii"),
        ({}, TypeError, "radii"),
    ],
)
def test_radii(tree, radii, error, word):
    refused(tree.build, error, word, **{**GOOD, "radii": radii})


@pytest.mark.parametrize("points", [np.zeros((5, 20, 3)), np.zeros((100, 3)), [np.zeros((20, 3))]])
@pytest.mark.parametrize("radii", [0.05, np.float32(0.05), np.full(5, 0.05)])
def test_radii_in_the_place_of_offsets(tree, tmp_path, points, radii):
    for call in (tree.build, fcl_fibers.show, lambda *a: fcl_fibers.write(tmp_path / "a.txt", *a)):
        with pytest.raises(TypeError, match="offsets.*radi(us|i) by name: radi(us|i)="):
            call(points, radii)
    with pytest.raises(TypeError, match="offsets"):
        fcl_fibers.root_segments(points, radii, 1.0)


def test_points_by_fiber_beside_offsets(tree):
    text = r"\(2, 2, 3\); give \(n, 3\), or leave out the offsets"
    with pytest.raises(ValueError, match=text):
        tree.build(FIBERS["points"], [0, 2, 4], 0.5)


@pytest.mark.parametrize("radii", [0.1, np.float64(0.1), np.zeros(4), [0.1, 0.1], (0.1,)])
def test_radii_in_the_place_of_the_end(tree, radii):
    points = np.zeros((int(tree._tree.offsets[-1]), 3))
    refused(tree.update, TypeError, "end", " by name: ", points=points, end=radii)
    refused(tree.update, ValueError, "end are of fibers", points=points, end=[])


def test_huge_numbers_are_refused_or_work(tree):
    largest = np.finfo(np.float32).max
    other = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=0)
    for points in (with_number(1e300), with_number(largest, np.float32)):
        other.build(points, GOOD["offsets"], 0.5)
        assert len(other.pairs()) == len(other.contacts())
    # float32 has no number above this one.
    floats = GOOD["points"].astype(np.float32)
    for radius in (1e300, float(largest) * 1.5):
        refused(tree.build, ValueError, "radi", points=floats, offsets=[0, 2, 4], radii=radius)
    refused(tree.build, ValueError, "overflow", **{**GOOD, "points": with_number(1.7e308)})


@pytest.mark.parametrize("name", ["closed", "groups", "meets", "root_segments"])
def test_what_each_fiber_has(tree, name):
    for values, error, word in [
        ([1], ValueError, "2 fibers"),
        ([1, 1, 1], ValueError, "2 fibers"),
        ([], ValueError, "2 fibers"),
        ([[1, 1]], ValueError, "(1, 2)"),
        (1, ValueError, "()"),
        ([0.5, 1.0], TypeError, "float"),
        (["a", "b"], TypeError, name),
        ([None, None], TypeError, name),
        ([0, 2**40], ValueError, name),
        ([0, -(2**40)], ValueError, name),
    ]:
        refused(tree.build, error, word, name, **{**GOOD, name: values})
    if name != "groups":
        refused(tree.build, ValueError, "", **{**GOOD, name: [0, -1]})
    if name == "closed":
        refused(tree.build, ValueError, "closed", **{**GOOD, name: [0, 2]})


def test_updates(tree):
    count = int(tree._tree.offsets[-1])
    for points, word in [
        (np.zeros((count + 1, 3)), str(count)),
        (np.zeros((count - 1, 3)), str(count)),
        (np.zeros((count, 2)), f"({count}, 2)"),
        ([np.zeros((count, 3))], "other numbers of points"),
        (np.zeros((2, 2, 3)), "other numbers of points"),
        (np.full((count, 3), np.nan), "point 0"),
    ]:
        refused(tree.update, ValueError, word, points=points)
        refused(tree.update, ValueError, "", points=np.zeros((count, 3)), end=points)
        refused(tree.update, ValueError, "", points=points, end=np.zeros((count, 3)))
    good = np.zeros((count, 3))
    refused(tree.update, TypeError, "end_radii", points=good, end_radii=1.0)
    refused(tree.update, ValueError, "radi", points=good, radii=-1.0)
    refused(tree.update, ValueError, "radi", points=good, radii=[1.0, 2.0])
    refused(tree.update, ValueError, "radi", points=good, end=good, end_radii=np.nan)
    refused(tree.update, TypeError, "complex", points=good * 1j)


def test_shapes_of_queries(tree):
    zero, one = (0, 0, 0), (1, 1, 1)
    capsule, box = fcl_fibers.CapsuleShape, fcl_fibers.BoxShape
    refused(capsule, ValueError, "start has shape", start=(0, 0), end=zero, radius=1)
    refused(capsule, ValueError, "end has shape", start=zero, end=0, radius=1)
    refused(box, ValueError, "low has shape", low=(0, 0), high=zero)
    refused(box, ValueError, "rotation has shape", low=zero, high=one, rotation=one)
    for shape, text in [
        (capsule(zero, one, -1), "the capsule: radius is -1"),
        (capsule((0, 0, np.nan), one, 1), "the capsule: start[2] is nan"),
        (fcl_fibers.SphereShape(zero, np.inf), "the sphere: radius is inf"),
        (box((1, 0, 0), (0, 1, 1)), "the box: low[0] is 1 and exceeds high[0]"),
        (box(zero, one, np.zeros((3, 3))), "the box: the rotation is not orthonormal"),
        (fcl_fibers.HalfSpaceShape(zero, 1), "the half-space: normal is 0"),
        (fcl_fibers.PlaneShape(one, np.nan), "the plane: offset is nan"),
    ]:
        for call in (tree.pairs, tree.contacts):
            refused(call, ValueError, text, other=shape)
    ball = fcl_fibers.SphereShape(zero, 1)
    refused(tree.nearest, TypeError, "SphereShape", other=ball, distance=1)
    refused(tree.moving_pairs, TypeError, "SphereShape", other=ball)
    refused(tree.volumes, ValueError, "depth", depth=-1)


def test_types_of_scalars(tree):
    mesh = fcl_fibers.TriangleMesh(np.eye(3), [[0, 1, 2]])
    ends = dict(start=(0, 0, 0), end=(0, 0, 1))
    refused(fcl_fibers.CapsuleShape, TypeError, "radius is '1'", **ends, radius="1")
    refused(fcl_fibers.CapsuleShape, TypeError, "radius", **ends, radius=[1.0])
    refused(fcl_fibers.BoxShape, TypeError, "complex", low=(0, 0, 0), high=(1, 1, 1j))
    refused(tree.nearest, TypeError, "distance is None", other=mesh, distance=None)
    refused(tree.volumes, TypeError, "depth is 1.5", depth=1.5)
    refused(tree.volumes, ValueError, "depth", depth=2**40)
    refused(tree.visit_pairs, TypeError, "visit is None", visit=None)
    refused(tree.visit_pairs, TypeError, "block is '1'", visit=len, block="1")
    refused(tree.visit_pairs, ValueError, "block", visit=len, block=2**70)
    refused(tree.visit_pairs, ValueError, "block", visit=len, block=0)
    length = dict(points=np.eye(3), offsets=[0, 3])
    refused(fcl_fibers.root_segments, TypeError, "length is 'a'", **length, length="a")
    refused(fcl_fibers.root_segments, ValueError, "length", **length, length=-1)
    for bits, error in ((-1, ValueError), (2**32, ValueError), (1.0, TypeError)):
        with pytest.raises(error, match="categories"):
            mesh.categories = bits


def test_a_tree_in_the_place_of_a_mesh(tree):
    mesh = fcl_fibers.TriangleMesh(np.eye(3), [[0, 1, 2]])
    for wrong in (1, None, tree):
        refused(tree.touching_segments, TypeError, "mesh", "give a TriangleMesh", mesh=wrong)
        if wrong == 1:
            refused(tree.nearest, TypeError, "other", "give a FiberTree or", other=wrong)
        if wrong is not None:
            for call in (tree.impacts, tree.safe_step):
                refused(call, TypeError, "mesh_end", "TriangleMesh", other=mesh, mesh_end=wrong)
    refused(tree.impacts, TypeError, "mesh_end", other=tree, mesh_end=mesh)
    sphere = fcl_fibers.SphereShape((0, 0, 0), 1)
    for wrong in (mesh, sphere, 1):
        text = f"other is a {type(wrong).__name__}; give a FiberTree"
        for call, others in (
            (lambda: tree.visit_pairs(len, wrong), "pairs"),
            (lambda: tree.moving_pairs(wrong), "impacts"),
        ):
            with pytest.raises(TypeError) as raised:
                call()
            reason = "" if wrong == 1 else f"; {others}() takes meshes and shapes"
            assert str(raised.value) == text + reason
    for call in (tree.nearest, tree.closest, tree.distance):
        text = "give a FiberTree or a TriangleMesh: contacts() has the distances of a shape"
        refused(call, TypeError, "SphereShape", text, other=sphere)
    contacts = tree.contacts(sphere)
    forces = np.ones(len(contacts))
    for call in (tree.nodes, lambda c, other: tree.accumulate(c, forces, other=other)):
        text = "give a FiberTree or a TriangleMesh: a shape has no points"
        refused(lambda: call(contacts, sphere), TypeError, "SphereShape", text)


def test_structured_arrays_in_the_place_of_numbers(tree):
    contacts = tree.contacts()
    segments = dict(segments=contacts)
    refused(tree.fiber_segment, TypeError, "field a of contacts", "pairs()", **segments)
    for name in ("points", "offsets", "radii", "closed"):
        refused(tree.build, TypeError, name, "fields a, b", **{**GOOD, name: contacts})


def test_errors_name_nothing_of_cpp(tree, tmp_path):
    """No text has a name of C++, which a program in Python has never seen."""
    mesh = fcl_fibers.TriangleMesh(np.eye(3), [[0, 1, 2]])
    volumes = fcl_fibers.FiberTree(report="volumes")
    spheres = fcl_fibers.FiberTree(report="volumes", volumes="spheres")
    for other in (volumes, spheres):
        other.build(**GOOD)
    turned = [[0, 1, 0], [1, 0, 0], [0, 0, 1]]
    (tmp_path / "a.tck").write_bytes(b"mrtrix")
    texts = []
    for call in (
        tree.impacts,
        tree.moving_pairs,
        tree.safe_step,
        lambda: tree.impact_contacts(tree.contacts()),
        lambda: tree.build([[(0, 0, 0), (1, 1, np.nan)]], radii=0.5),
        lambda: tree.build([[(0, 0, 0), (1, 1, 1)]], radii=-0.5),
        lambda: tree.build(**GOOD, root_segments=[-1, 0]),
        lambda: tree.pairs(volumes),
        lambda: tree.pairs(spheres),
        lambda: volumes.pairs(mesh),
        lambda: spheres.update(GOOD["points"], GOOD["points"]),
        lambda: tree.volumes(-1),
        lambda: tree.nearest(mesh, -1),
        lambda: tree.pairs(fcl_fibers.BoxShape((1, 0, 0), (0, 1, 1))),
        lambda: tree.pairs(fcl_fibers.CapsuleShape((0, 0, 0), (1, 0, 0), -1)),
        lambda: tree.fiber_segment([-5]),
        lambda: fcl_fibers.fiber_pairs(tree.contacts(order="fibers")[::-1]),
        lambda: fcl_fibers.FiberTree(threads=0),
        lambda: fcl_fibers.root_segments([np.eye(3)], None, -1),
        lambda: fcl_fibers.TriangleMesh(np.eye(3), [[0, 1, 3]]),
        lambda: fcl_fibers.TriangleMesh(np.eye(3), [[0, 1, 2]], solid=True),
        lambda: mesh.set_pose(turned, (0, 0, 0)),
        lambda: mesh.update(np.eye(4, 3)),
        lambda: fcl_fibers.show([np.full((2, 3), np.nan)], radii=0.1),
        lambda: fcl_fibers.read(tmp_path / "a.tck"),
    ):
        with pytest.raises((ValueError, TypeError)) as raised:
            call()
        texts.append(str(raised.value))
    cpp = re.compile(r"::|fcl_fibers: |\bk[A-Z]|\b[a-z]+[A-Z]\w*")
    assert [text for text in texts if cpp.search(text.replace(str(tmp_path), ""))] == []
    assert texts[0] == "the fibers rest; call update(start, end) before"
    assert "report='capsules'" in " ".join(texts) and "volumes='boxes'" in " ".join(texts)


@pytest.mark.parametrize("impacts", [np.zeros(3), np.zeros((2, 2)), [], None, "impacts"])
def test_impacts_of_another_type(tree, impacts):
    points = random_scene(1).points
    tree.update(points, points)
    refused(tree.impact_contacts, TypeError, "impacts", impacts=impacts)
    tree.update(points)


@pytest.mark.parametrize(
    "options, error, word",
    [
        (dict(report="capsule"), ValueError, "report"),
        (dict(topology="tree"), ValueError, "topology"),
        (dict(volumes="balls"), ValueError, "volumes"),
        (dict(report=None), ValueError, "report"),
        (dict(report=[]), ValueError, "report"),
        (dict(ignored_neighbors=-1), ValueError, "ignored_neighbors"),
        (dict(ignored_arc_length=-1.0), ValueError, "ignored_arc_length"),
        (dict(ignored_arc_length=np.nan), ValueError, "ignored_arc_length"),
        (dict(margin=-0.1), ValueError, "margin"),
        (dict(margin=np.inf), ValueError, "margin"),
        (dict(threads=0), ValueError, "threads"),
        (dict(threads=1.5), TypeError, "threads"),
        (dict(ignored_neighbors=2**40), (TypeError, ValueError), "ignored_neighbors"),
        (dict(margin="0"), TypeError, "margin"),
        (dict(nonsense=1), TypeError, "nonsense"),
    ],
)
def test_options(options, error, word):
    refused(fcl_fibers.FiberTree, error, word, **options)
