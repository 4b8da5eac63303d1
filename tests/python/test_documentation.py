# SPDX-License-Identifier: BSD-3-Clause
"""What help() and an editor tell."""

import ast
import inspect
import json
import pathlib
import pydoc
import subprocess
import sys
import typing

import pytest

import fcl_fibers
from fcl_fibers import _core

PUBLIC = {n: getattr(fcl_fibers, n) for n in fcl_fibers.__all__ if not n.startswith("__")}
MEMBERS = [
    (f"{name}.{member}", value)
    for name, one in PUBLIC.items()
    if inspect.isclass(one) and not issubclass(one, tuple)
    for member, value in vars(one).items()
    if not member.startswith("_")
]
FUNCTIONS = [
    (name, value)
    for name, value in [*PUBLIC.items(), *MEMBERS, ("FiberTree", fcl_fibers.FiberTree.__init__)]
    if inspect.isfunction(value)
]


def test_names():
    assert sorted(fcl_fibers.__all__) == fcl_fibers.__all__
    assert fcl_fibers.__version__ == _core.version and fcl_fibers.__doc__
    assert all(one.__module__.startswith("fcl_fibers") for one in PUBLIC.values())


@pytest.mark.parametrize("name, one", [*PUBLIC.items(), *MEMBERS])
def test_every_public_name_has_a_text(name, one):
    text = inspect.getdoc(one)
    assert text
    # A NamedTuple without a text gets its signature.
    assert not text.startswith(f"{name}(")


@pytest.mark.parametrize("name, function", FUNCTIONS)
def test_every_argument_has_a_type(name, function):
    hints = typing.get_type_hints(function)
    arguments = inspect.signature(function).parameters
    assert set(arguments) - {"self", "mesh"} <= set(hints) | {"self"}
    assert "return" in hints


def test_help_tells_shapes_and_units():
    for one, words in [
        (fcl_fibers.FiberTree, ["unit of the points", "threads", "RuntimeError", "a copy"]),
        (fcl_fibers.FiberTree.build, ["(n, 3)", "(fibers + 1,)", "(fibers, n, 3)", "(fibers,)"]),
        (fcl_fibers.FiberTree.pairs, ["(n, 2) int32", "a < b"]),
        (fcl_fibers.FiberTree.contacts, ["distance", "(3,)", "normal", "weights"]),
        (fcl_fibers.FiberTree.impacts, ["time"]),
        (fcl_fibers.FiberTree.closest, ["contacts()", "infinite", "-1"]),
        (fcl_fibers.FiberTree.nearest, ["(n, 2) int32"]),
        (fcl_fibers.FiberTree.nearest_to, ["(m, 3)", "(n, 2) int32"]),
        (fcl_fibers.FiberTree.holding, ["(m, 3)", "(n, 2) int32"]),
        (fcl_fibers.FiberTree.fiber_segment, ["(..., 2)", "int64"]),
        (fcl_fibers.FiberTree.running_number, ["int64", "tree.segments"]),
        (fcl_fibers.FiberTree.nodes, ["(n, 4)", "(n, 2)", "(n, 3)", "sum up to 1"]),
        (fcl_fibers.FiberTree.accumulate, ["(points, 3)", "(n, 3)", "opposite", "ValueError"]),
        (fcl_fibers.LivePairs, ["unit of the points", "RuntimeError", "tree.update(points)"]),
        (fcl_fibers.LivePairs.pairs, ["(n, 2) int32", "order"]),
        (fcl_fibers.LivePairs.safe_distances, ["(points,) float64", "infinity", "ValueError"]),
        (fcl_fibers.LivePairs.slots, ["(n,) int32", "order of pairs()"]),
        (fcl_fibers.fiber_pairs, ["contacts[begin:end]", "deepest", "order"]),
        (fcl_fibers.flat, ["point_a_x", "weight_0", "no copy"]),
        (fcl_fibers.read_mesh, ["(n, 3) float64", "(m, 3) int32"]),
        (fcl_fibers.TriangleMesh, ["(n, 3)", "(m, 3)", "counterclockwise", "watertight"]),
        (fcl_fibers.TriangleMesh.set_pose, ["(3, 3)", "(3,)", "rotation @ p + position"]),
        (fcl_fibers.read, [".hair", "unit", "OSError", "ValueError"]),
        (fcl_fibers.write, [".vtp", ".hair", ".txt"]),
    ]:
        text = pydoc.render_doc(one, renderer=pydoc.plaintext)
        assert all(word in text for word in words), (one, words)


def test_fields_of_contacts_are_those_of_help():
    text = fcl_fibers.FiberTree.contacts.__doc__
    tree = fcl_fibers.FiberTree(report="capsules", ignored_neighbors=0)
    mesh = fcl_fibers.TriangleMesh([(0, 0, 0)], [(0, 0, 0)])
    for array in (tree.contacts(), tree.contacts(mesh)):
        assert all(field in text for field in array.dtype.names)


def test_defaults_are_those_of_the_table(tmp_path):
    """C++ compares its own with the same table, in tests/readme."""
    page = (pathlib.Path(__file__).parents[2] / "docs" / "options.md").read_text(encoding="utf-8")
    rows = [[cell.strip(" `") for cell in line.split("|")] for line in page.splitlines()]
    begin = next(i for i, row in enumerate(rows) if row[1:4] == ["option", "what it does", "trees"])
    end = next(i for i in range(begin, len(rows)) if len(rows[i]) == 1)
    names = {"kCapsules": "capsules", "kBundle": "bundle", "kLayeredBoxes": "boxes"}
    table = {row[1]: names.get(row[3], row[3]) for row in rows[begin + 2 : end] if row[3]}

    def same(name, value):
        return str(value) == table[name] or float(value) == float(table[name])

    options = fcl_fibers.FiberTree().options._asdict()
    assert options.keys() == table.keys()
    assert all(same(*option) for option in options.items())
    shown = inspect.signature(fcl_fibers.show).parameters
    common = shown.keys() & table.keys()
    assert len(common) == 3 and all(same(name, shown[name].default) for name in common)
    scene = tmp_path / "line.txt"
    scene.write_text("0 0 0\n1 0 0\n")
    command = [sys.executable, "-m", "fcl_fibers", "check", "-r", "1", "--json", str(scene)]
    told = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
    common = told.keys() & table.keys()
    assert len(common) == 5 and all(same(name, told[name]) for name in common)


def test_stubs_have_the_names_of_the_module():
    package = pathlib.Path(fcl_fibers.__file__)
    stubs = package.with_name("_core.pyi")
    if not stubs.exists():
        stubs = package.resolve().with_name("_core.pyi")
    if not stubs.exists():
        pytest.skip("there are no stubs")

    def names(body):
        for node in body:
            if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
                yield node.name
            elif isinstance(node, ast.AnnAssign):
                yield node.target.id

    tree = ast.parse(stubs.read_text())
    assert public(names(tree.body)) == public(vars(_core))
    for node in tree.body:
        if isinstance(node, ast.ClassDef) and hasattr(_core, node.name):
            assert public(names(node.body)) == public(vars(getattr(_core, node.name)))


def public(names):
    return {name for name in names if not name.startswith("_")}
