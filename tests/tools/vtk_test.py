# SPDX-License-Identifier: BSD-3-Clause
"""What fcl_fibers writes for programs that draw, read by VTK, against what it says itself. Needs
Debian's python3-vtk9; tests/full.sh vtk runs it."""

import json
import unittest
from collections import Counter

from program import ProgramTest
from vtkmodules.vtkFiltersCore import vtkFeatureEdges
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

SCENE = "helix:fibers=12,segments=15,radius=0.04"
SEGMENTS, FIBERS = 12 * 15, 12
POINTS = SEGMENTS + FIBERS


def values(arrays):
    """By name the numbers of arrays of points or of cells."""
    found = {}
    for i in range(arrays.GetNumberOfArrays()):
        array = arrays.GetArray(i)
        assert array.GetNumberOfComponents() == 1, array.GetName()
        found[array.GetName()] = [array.GetValue(k) for k in range(array.GetNumberOfTuples())]
    return found


def points(data):
    return [data.GetPoint(i) for i in range(data.GetNumberOfPoints())]


def cells(data):
    """Of each cell its points."""
    found = []
    for i in range(data.GetNumberOfCells()):
        ids = data.GetCell(i).GetPointIds()
        found.append([ids.GetId(k) for k in range(ids.GetNumberOfIds())])
    return found


class Vtk(ProgramTest):
    def read(self, path):
        reader = vtkXMLPolyDataReader()
        # VTK tells of errors and goes on.
        told = []
        for event in ("ErrorEvent", "WarningEvent"):
            reader.AddObserver(event, lambda _, name: told.append(name))
        reader.SetFileName(str(path))
        reader.Update()
        self.assertEqual((told, reader.GetErrorCode()), ([], 0), path.name)
        return reader.GetOutput()

    def check(self, what, *more):
        """What `check` says of the scene, and what VTK reads of a picture of it."""
        path = self.folder / (what + ".vtp")
        text = self.run_program(
            "check", SCENE, "--json", "--sort", "fiber", f"--write-{what}", path, *more, code=1
        )
        said = json.loads(text)
        self.assertEqual((said["fibers"], said["segments"]), (FIBERS, SEGMENTS))
        self.assertGreater(said["contact_count"], 20)
        return said, self.read(path)

    def assert_points(self, data, expected, delta):
        self.assertEqual(data.GetNumberOfPoints(), len(expected))
        for one, other in zip(points(data), expected):
            for x, y in zip(one, other):
                self.assertAlmostEqual(x, y, delta=delta)

    def test_fibers(self):
        said = json.loads(self.run_program("info", SCENE, "--json"))
        self.assertEqual(said["points"], POINTS)
        path = self.folder / "fibers.vtp"
        self.run_program("generate", SCENE, "-o", path)
        data = self.read(path)
        self.assertEqual(data.GetNumberOfPoints(), POINTS)
        bounds = data.GetPoints().GetBounds()
        self.assertEqual(list(bounds[0::2]), said["bounds"]["min"])
        self.assertEqual(list(bounds[1::2]), said["bounds"]["max"])
        self.assertEqual(data.GetNumberOfLines(), FIBERS)
        self.assertEqual(cells(data), [list(range(16 * f, 16 * f + 16)) for f in range(12)])
        self.assertEqual(values(data.GetCellData()), {"fiber": list(range(FIBERS))})
        self.assertEqual(values(data.GetPointData()), {"radius": POINTS * [0.04]})

    def test_segments(self):
        said, data = self.check("segments")
        self.assertEqual(data.GetNumberOfPoints(), POINTS)
        self.assertEqual(data.GetNumberOfLines(), SEGMENTS)
        self.assertEqual(data.GetNumberOfCells(), SEGMENTS)
        read = values(data.GetCellData())
        self.assertEqual(sorted(read), ["fiber", "number", "touching"])
        names = list(zip(read["fiber"], read["number"]))
        self.assertEqual(names, [(f, s) for f in range(12) for s in range(15)])
        self.assertEqual(cells(data), [[16 * f + s, 16 * f + s + 1] for f, s in names])
        of_contacts = {(c["fiber_" + k], c["number_" + k]) for c in said["contacts"] for k in "ab"}
        red = {name for name, touching in zip(names, read["touching"]) if touching}
        self.assertEqual(red, of_contacts)
        self.assertEqual(sum(read["touching"]), said["touching_segments"])

    def test_contacts(self):
        said, data = self.check("contacts")
        contacts = said["contacts"]
        self.assertEqual(data.GetNumberOfVerts(), said["contact_count"])
        read = values(data.GetCellData())
        for k, axis in enumerate("xyz"):
            self.assertEqual(read.pop("normal_" + axis), [c["normal"][k] for c in contacts])
        names = [name for name in contacts[0] if name not in ("point_a", "point_b", "normal")]
        self.assertEqual(list(read), names)
        for name in names:
            self.assertEqual(read[name], [c[name] for c in contacts], name)
        middles = [[(a + b) / 2 for a, b in zip(c["point_a"], c["point_b"])] for c in contacts]
        self.assert_points(data, middles, 1e-15)

    def test_volumes(self):
        """A volume would have holes in ParaView, or stand for other segments."""
        for kind, faces, corners in (("boxes", 6, 8), ("spheres", 320, 162)):
            more = ("--volumes", kind, "--depth", 2)
            _, data = self.check("volumes", *more)
            read = values(data.GetCellData())
            self.assertEqual(sorted(read), ["segments", "volume"])
            below = dict(zip(read["volume"], read["segments"]))
            self.assertEqual(sum(below.values()), SEGMENTS)
            self.assertGreater(len(below), 2)
            self.assertEqual(Counter(read["volume"]), {v: faces for v in range(len(below))})
            self.assertEqual(data.GetNumberOfPolys(), faces * len(below))
            self.assertEqual(data.GetNumberOfPoints(), corners * len(below))
            edges = vtkFeatureEdges()
            edges.SetInputData(data)
            edges.FeatureEdgesOff()
            edges.BoundaryEdgesOn()
            edges.NonManifoldEdgesOn()
            edges.Update()
            self.assertEqual(edges.GetOutput().GetNumberOfCells(), 0, "open surfaces")


if __name__ == "__main__":
    unittest.main()
