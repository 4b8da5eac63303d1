# SPDX-License-Identifier: BSD-3-Clause
"""Random fibers and options against brute force, and random calls that are refused."""

import hypothesis
import hypothesis.extra.numpy as arrays
import numpy as np
from hypothesis import strategies as st

import fcl_fibers
import oracles

# Few numbers, so that points coincide and axes are parallel, and any numbers.
COORDINATES = st.one_of(
    st.sampled_from([0.0, 1.0, -1.0, 0.5, 2.0, 3.0, 1e-3]),
    st.floats(-4, 4, width=32).map(lambda x: round(x, 6)),
)
RADII = st.one_of(st.sampled_from([0.0, 0.5, 0.25]), st.floats(0, 1, width=32))


@st.composite
def scenes(draw, rules=True):
    counts = draw(st.lists(st.integers(0, 6), max_size=8))
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    count = int(offsets[-1])
    points = draw(arrays.arrays(float, (count, 3), elements=COORDINATES, fill=st.nothing()))
    for i in draw(st.lists(st.integers(1, count - 1), max_size=6) if count > 1 else st.just([])):
        kind = draw(st.sampled_from(["zero", "parallel", "nearly parallel"]))
        if kind == "zero":
            points[i] = points[i - 1]
        elif i >= 3:
            points[i] = points[i - 1] + (points[i - 2] - points[i - 3]) * draw(COORDINATES)
            if kind == "nearly parallel":
                points[i, draw(st.integers(0, 2))] += draw(st.sampled_from([1e-6, 1e-9, 1e-12]))
    offset = draw(st.sampled_from([0.0, 0.0, 1000.0, 1e6, -1e6]))
    dtype = draw(st.sampled_from([np.float32, np.float64]))
    points = (points + offset).astype(dtype)
    radii = draw(arrays.arrays(float, count, elements=RADII)).astype(dtype)
    fibers = len(counts)
    if fibers == count:  # else radii could be one for each fiber, and are refused
        radii[:] = radii[:1]
    scene = oracles.Scene(points, offsets, radii)
    if rules and draw(st.booleans()):
        closed = draw(arrays.arrays(bool, fibers))
        for begin, end in zip(offsets[:-1][closed], offsets[1:][closed]):
            if begin < end:
                points[end - 1] = points[begin]
        groups = draw(arrays.arrays(np.int32, fibers, elements=st.integers(-1, 2)))
        scene = oracles.Scene(points, offsets, radii, closed, groups)
    return scene


@st.composite
def options(draw):
    return dict(
        report=draw(st.sampled_from(["capsules", "capsules", "volumes"])),
        topology=draw(st.sampled_from(["bundle", "super_thread"])),
        volumes=draw(st.sampled_from(["boxes", "spheres"])),
        ignored_neighbors=draw(st.integers(0, 3)),
        margin=draw(st.sampled_from([0.0, 0.0, 0.125, 1.0])),
        threads=draw(st.integers(1, 2)),
    )


def check_tree(tree, scene):
    chosen = tree.options
    oracles.check_pairs(
        tree.pairs(),
        scene,
        margin=chosen.margin,
        report=chosen.report,
        volumes=chosen.volumes,
        ignored_neighbors=chosen.ignored_neighbors,
    )


@hypothesis.given(scenes(), options())
def test_pairs_and_contacts(scene, chosen):
    tree = fcl_fibers.FiberTree(**chosen)
    tree.build(**scene.arguments)
    check_tree(tree, scene)
    pairs, contacts = tree.pairs(), tree.contacts()
    both = tree.fiber_segment(pairs)
    assert (both[:, 0, 0] == contacts["fiber_a"]).all()
    assert (both[:, 1, 1] == contacts["number_b"]).all()
    gap, error = oracles.gaps(scene, scene)
    i, j = np.searchsorted(scene.names, pairs).T
    assert (np.abs(contacts["distance"] - gap[i, j]) <= error[i, j]).all()
    lengths = oracles.length(contacts["normal"])
    assert (np.abs(lengths - 1) < 1e-12).all()


@hypothesis.given(scenes(), scenes(), options())
def test_pairs_of_two_trees(a, b, chosen):
    trees = []
    for scene in (a, b):
        tree = fcl_fibers.FiberTree(**chosen)
        tree.build(**scene.arguments)
        trees.append(tree)
    gap, error = oracles.gaps(a, b, chosen["report"], chosen["volumes"])
    pairs = trees[0].pairs(trees[1])
    if chosen["report"] == "volumes" and len(pairs) > 0:
        # Volumes are floats in the frame of one tree. If that is far smaller than the other one or
        # the margin, more of them may overlap there, and none may be missed.
        sizes = [scene.extent() + 2 * scene.radius.max() for scene in (a, b)]
        if min(sizes) < 2.0**-10 * max(*sizes, chosen["margin"]):
            i, j = np.searchsorted(a.names, pairs[:, 0]), np.searchsorted(b.names, pairs[:, 1])
            error[i, j] = np.inf
    oracles.check(pairs, a.names, b.names, gap - chosen["margin"], error)
    assert len(trees[0].contacts(trees[1])) == len(pairs)


@hypothesis.given(scenes(rules=False), options(), st.data())
def test_updates_leave_nothing_behind(scene, chosen, data):
    tree = fcl_fibers.FiberTree(**chosen)
    tree.build(**scene.arguments)
    for _ in range(data.draw(st.integers(1, 3))):
        moved = data.draw(
            arrays.arrays(float, scene.points.shape, elements=COORDINATES, fill=st.nothing())
        )
        moved = moved.astype(data.draw(st.sampled_from([np.float32, np.float64])))
        tree.update(moved)
        check_tree(tree, oracles.Scene(moved, scene.offsets, scene.radii))


WRONG = st.one_of(
    st.none(),
    st.text(max_size=3),
    st.integers(-(2**70), 2**70),
    st.floats(),
    st.complex_numbers(),
    st.booleans(),
    st.binary(max_size=3),
    st.lists(st.integers(-3, 9) | st.floats() | st.none(), max_size=5),
    st.lists(st.lists(st.floats(-1, 1), max_size=4), max_size=3),
    st.builds(object),
    st.dictionaries(st.integers(), st.integers(), max_size=2),
    arrays.arrays(
        arrays.scalar_dtypes(),
        arrays.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4),
    ),
    arrays.arrays(
        st.sampled_from([np.float32, np.float64, np.int64]),
        st.tuples(st.integers(0, 5), st.just(3)),
        elements=st.integers(-1, 6),
    ),
    st.sampled_from([np.arange(3), np.array([0, 2, 4]), np.zeros((4, 3)), 0.5]),
)
CALLS = {
    "build": ["points", "offsets", "radii", "closed", "groups", "meets", "root_segments"],
    "update": ["points", "end", "radii", "end_radii"],
    "pairs": ["other", "order"],
    "visit_pairs": ["visit", "other", "block"],
    "contacts": ["other", "order", "bare"],
    "nodes": ["contacts", "other"],
    "accumulate": ["contacts", "forces", "out", "other", "other_out"],
    "impacts": ["other", "mesh_end"],
    "impact_contacts": ["impacts", "other", "mesh_end"],
    "moving_pairs": ["other"],
    "safe_step": ["other", "mesh_end"],
    "touching_segments": ["mesh"],
    "closest": ["other"],
    "distance": ["other"],
    "nearest": ["other", "distance"],
    "nearest_to": ["points", "distance"],
    "holding": ["points"],
    "fiber_segment": ["segments"],
    "running_number": ["segments"],
    "volumes": ["depth"],
}
MESH = fcl_fibers.TriangleMesh(np.eye(3), [[0, 1, 2]])


def quiet(*_):
    """A visitor."""


@hypothesis.settings(max_examples=10 * hypothesis.settings().max_examples)
@hypothesis.given(st.sampled_from(sorted(CALLS)), st.data())
def test_random_calls(name, data):
    """Any call is answered or refused by an error that a program may expect, and one that is
    refused changes no answer."""
    points, offsets = np.eye(4, 3), np.array([0, 2, 4])
    tree = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=0)
    tree.build(points, offsets, 0.75)
    before = tree.contacts()
    good = dict(
        points=points,
        end=points,
        offsets=offsets,
        radii=0.5,
        end_radii=0.5,
        other=data.draw(st.sampled_from([None, tree, MESH])),
        mesh=MESH,
        mesh_end=MESH,
        visit=quiet,
        block=2,
        distance=1.0,
        depth=1,
        start=(0, 0, 0),
        radius=1.0,
        low=(0, 0, 0),
        high=(1, 1, 1),
        segments=[0, 2],
        order="fibers",
        bare=True,
        contacts=before,
        forces=np.ones(len(before)),
        out=np.zeros((4, 3)),
        other_out=np.zeros((4, 3)),
    )
    arguments = {}
    for argument in CALLS[name]:
        kind = data.draw(st.sampled_from(["good", "wrong", "none"]))
        if kind == "wrong":
            arguments[argument] = data.draw(WRONG)
        elif kind == "good" and argument in good:
            arguments[argument] = good[argument]
    try:
        with np.errstate(all="ignore"):
            getattr(tree, name)(**arguments)
    except (ValueError, TypeError, OverflowError) as error:
        assert "incompatible function arguments" not in str(error)
        assert (tree.contacts() == before).all()
        tree.update(points)
    else:
        if name not in ("build", "update"):
            assert (tree.contacts() == before).all()
        # Whatever was built can be asked.
        assert len(tree.pairs()) == tree.contacts().shape[0]


def test_calls_are_all_that_a_tree_has():
    public = {n for n in vars(fcl_fibers.FiberTree) if not n.startswith("_")}
    values = {"fiber_count", "segment_count", "memory_usage", "options"}
    values |= {"points", "radii", "offsets", "segments"}
    assert public - values == set(CALLS)
