# SPDX-License-Identifier: BSD-3-Clause
"""The program fcl_fibers, as a user meets it."""

import base64
import gzip
import json
import math
import os
import re
import shutil
import signal
import stat
import struct
import subprocess
import sys
import time
import unittest
from pathlib import Path

from program import CONTACT_COLUMNS, CROSSING, PROGRAM, ProgramTest, box
from program import read_polylines, read_vtp

SOURCES = Path(__file__).resolve().parents[2]
LOADS = SOURCES / "scenes" / "recorded_loads.txt"

HELPED = ("generate", "convert", "info", "check", "distance", "replay", "trade", "view")


class Pictures(ProgramTest):
    def setUp(self):
        super().setUp()
        self.fibers = self.write("crossing.txt", CROSSING)
        self.points = [p for fiber in read_polylines(self.fibers_without_comment()) for p in fiber]

    def fibers_without_comment(self):
        return self.write("plain.txt", CROSSING.split("\n", 1)[1])

    def export(self, what, *more):
        path = self.folder / (what + ".vtp")
        self.run_program("check", self.fibers, "-r", 0.006, f"--write-{what}", path, *more, code=1)
        return path

    def test_segments(self):
        """ParaView would show other fibers, or other segments red."""
        points, cells, point_data, data = read_vtp(self.export("segments"))
        self.assertEqual(points, self.points)
        self.assertEqual(cells["Lines"], [[0, 1], [1, 2], [2, 3], [4, 5], [6, 7]])
        self.assertEqual(data["fiber"], [0, 0, 0, 1, 2])
        self.assertEqual(data["number"], [0, 1, 2, 0, 0])
        self.assertEqual(data["touching"], [0, 1, 0, 1, 0])
        self.assertEqual(point_data["radius"], [0.006] * 8)

    def test_fibers_without_points(self):
        """Fibers after one without points would have the number of another, or a read beyond."""
        nan, inf = 3 * (math.nan,), 3 * (math.inf,)
        rows = [nan, *self.points[:4], nan, nan, *self.points[4:6], nan, *self.points[6:], nan, nan]
        head = b"mrtrix tracks\ndatatype: Float64LE\nfile: . 128\nEND\n".ljust(128, b"\n")
        self.fibers = self.folder / "some_empty.tck"
        self.fibers.write_bytes(head + b"".join(struct.pack("<3d", *row) for row in [*rows, inf]))
        data = read_vtp(self.export("segments"))[3]
        self.assertEqual(data["fiber"], [1, 1, 1, 3, 4])
        self.assertEqual(data["number"], [0, 1, 2, 0, 0])
        self.assertEqual(data["touching"], [0, 1, 0, 1, 0])
        data = read_vtp(self.export("contacts"))[3]
        self.assertEqual((data["fiber_a"], data["fiber_b"]), ([1], [3]))
        vtp = self.folder / "converted.vtp"
        self.run_program("convert", self.fibers, vtp)
        for path in (self.fibers, vtp):
            found = json.loads(self.run_program("info", path, "--json"))
            self.assertEqual((found["fibers"], found["segments"]), (6, 5))
            self.assertIn(
                "one point or none, which touch nothing: 3", self.run_program("info", path)
            )
            self.run_program("view", path, "-r", 0.006, "-o", self.folder / "page.html")
        for ending in ("txt", "hair"):
            self.run_program("convert", self.fibers, self.folder / f"out.{ending}", code=2)
            self.assertRegex(self.stderr, "fiber 0.* no points|points of fiber 0 is 0")

    def test_contacts(self):
        points, cells, _, data = read_vtp(self.export("contacts"))
        self.assertEqual(len(points), 1)
        self.assertLess(math.dist(points[0], (1.5, 0, 0.005)), 1e-15)
        self.assertEqual(cells["Verts"], [[0]])
        names = [name for name in CONTACT_COLUMNS if not name.startswith("point")]
        self.assertEqual(list(data), names)
        for name, expected in zip(names, (0, 1, 0.5, 1, 0, 0.5, -0.002, 0, 0, 1)):
            self.assertAlmostEqual(data[name][0], expected, delta=1e-15, msg=name)

    def test_volumes_hold_what_is_below_them(self):
        """A picture of the tree would show other volumes than it has."""
        radius = 0.006
        low = [min(p[k] for p in self.points) - radius for k in range(3)]
        high = [max(p[k] for p in self.points) + radius for k in range(3)]
        corners, faces, data = self.volumes("--depth", 0)
        self.assertEqual((len(corners), len(faces)), (8, 6))
        self.assertEqual(data["segments"], [5] * 6)
        for k in range(3):
            # The tree keeps floats relative to a scene of size 50.
            self.assertAlmostEqual(min(c[k] for c in corners), low[k], delta=1e-4)
            self.assertAlmostEqual(max(c[k] for c in corners), high[k], delta=1e-4)
        self.assertTrue(is_closed(faces))
        self.assertGreater(signed_volume(corners, faces), 0, "faces look inward")

        corners, faces, data = self.volumes("--depth", 9, "--volumes", "spheres")
        self.assertEqual(len(faces), 5 * 320)
        self.assertEqual(sorted(set(data["volume"])), [0, 1, 2, 3, 4])
        self.assertEqual(set(data["segments"]), {1})
        self.assertTrue(is_closed(faces))
        per_sphere = len(corners) // 5
        ends = {}
        for begin in range(0, len(corners), per_sphere):
            sphere = corners[begin : begin + per_sphere]
            middle = [sum(c[k] for c in sphere) / per_sphere for k in range(3)]
            radii = [math.dist(c, middle) for c in sphere]
            self.assertAlmostEqual(min(radii), max(radii), delta=1e-6)
            ends[tuple(round(x, 3) for x in middle)] = radii[0]
        # Around the middle of each segment, half as long and the radius.
        self.assertAlmostEqual(ends[(0.5, 0, 0)], 0.5 + radius, delta=1e-4)
        self.assertAlmostEqual(ends[(1.5, 0, 0.01)], 1 + radius, delta=1e-4)

    def volumes(self, *more):
        points, cells, _, data = read_vtp(self.export("volumes", *more))
        return points, cells["Polys"], data

    def test_another_ending_is_refused(self):
        path = self.folder / "picture.png"
        self.run_program("check", self.fibers, "--write-segments", path, code=2)
        self.assertIn(".vtp", self.stderr)
        self.assertNotIn("picture.png", self.files())


def is_closed(faces):
    """Each edge is walked once each way."""
    edges = [(a, b) for f in faces for a, b in zip(f, f[1:] + f[:1])]
    every_edge = set(edges)
    return len(every_edge) == len(edges) and all((b, a) in every_edge for a, b in edges)


def signed_volume(corners, faces):
    total = 0.0
    for face in faces:
        a = corners[face[0]]
        for i in range(1, len(face) - 1):
            b, c = corners[face[i]], corners[face[i + 1]]
            total += (
                a[0] * (b[1] * c[2] - b[2] * c[1])
                + a[1] * (b[2] * c[0] - b[0] * c[2])
                + a[2] * (b[0] * c[1] - b[1] * c[0])
            )
    return total / 6


class Generate(ProgramTest):
    SCENE = "cap:fibers=7,segments=5,seed=3"

    def test_every_format_holds_the_same_fibers(self):
        paths = {e: self.folder / ("scene" + e) for e in (".txt", ".vtp", ".hair")}
        for ending, path in paths.items():
            self.run_program("generate", self.SCENE, "-o", path)
            lost = "text has no place for the radius; read it with --radius 0.0035\n"
            self.assertEqual(self.stderr.endswith(lost), ending == ".txt", self.stderr)
        fibers = read_polylines(paths[".txt"])
        self.assertEqual([len(f) for f in fibers], [6] * 7)
        flat = [p for f in fibers for p in f]

        points, cells, point_data, data = read_vtp(paths[".vtp"])
        self.assertEqual(points, flat)
        self.assertEqual(cells["Lines"], [list(range(6 * f, 6 * f + 6)) for f in range(7)])
        self.assertEqual(data["fiber"], list(range(7)))
        self.assertEqual(set(point_data["radius"]), {0.0035})

        # Read back by the program itself.
        for ending in (".txt", ".vtp", ".hair"):
            found = json.loads(self.run_program("info", paths[ending], "--json"))
            self.assertEqual((found["fibers"], found["segments"]), (7, 35))
            if ending == ".txt":
                self.assertIsNone(found["radius"])
            else:
                self.assertAlmostEqual(found["radius"]["min"], 0.0035, delta=1e-9)
                self.assertEqual(found["radius"]["min"], found["radius"]["max"])
            for k in range(3):
                expected = max(p[k] for p in flat)
                delta = 1e-5 if ending == ".hair" else 0  # of floats of 20
                self.assertAlmostEqual(found["bounds"]["max"][k], expected, delta=delta)

    def test_generates_scenes_and_converts_files(self):
        path = self.write("crossing.txt", CROSSING)
        out = self.folder / "out.vtp"
        self.run_program("generate", path, "-o", out, code=2)
        self.assertIn("use: fcl_fibers convert", self.stderr)
        self.run_program("convert", self.SCENE, out, code=2)
        self.assertIn("use: fcl_fibers generate", self.stderr)
        self.assertEqual(self.files(), ["crossing.txt"])

    def test_converts_without_a_radius(self):
        """A conversion would invent a radius, or lose one."""
        path = self.write("crossing.txt", CROSSING)
        vtp, hair, text = (self.folder / f"out.{e}" for e in ("vtp", "hair", "txt"))
        for one, other in ((path, vtp), (vtp, hair), (hair, text)):
            self.run_program("convert", one, other)
            self.assertEqual(self.stderr, "")
            found = json.loads(self.run_program("info", other, "--json"))
            self.assertEqual((found["fibers"], found["radius"]), (3, None))
        near = [q for fiber in read_polylines(text) for q in fiber]
        self.assertAlmostEqual(near[4][2], 0.01, delta=1e-8)
        self.run_program("convert", path, vtp, "-r", 0.25)
        self.run_program("convert", vtp, hair)
        self.assertEqual(
            json.loads(self.run_program("info", hair, "--json"))["radius"]["max"], 0.25
        )
        self.run_program("convert", hair, text)
        self.assertIn("read it with --radius 0.25\n", self.stderr)

    def test_converts_radii_of_points(self):
        hair, vtp, text = (self.folder / f"out.{e}" for e in ("hair", "vtp", "txt"))
        head = struct.pack("<4s4If", b"HAIR", 1, 3, 6, 2, 1).ljust(128, b"\0")
        hair.write_bytes(head + struct.pack("<9f", *range(9)) + struct.pack("<3f", 3, 2, 1))
        for one, other in ((hair, vtp), (vtp, hair)):
            self.run_program("convert", one, other)
            radii = json.loads(self.run_program("info", other, "--json"))["radius"]
            self.assertEqual((radii["min"], radii["max"]), (1, 1.5))
        self.run_program("convert", hair, text)
        self.assertIn("those of this scene differ and are lost", self.stderr)

    def test_keys_of_a_scene(self):
        texts = []
        for scene in (
            self.SCENE,
            self.SCENE + ",frame=4",
            "cap:fibers=7,segments=5,seed=4",
            self.SCENE + ",radius=0.5",
            "paper-static:fibers=7,segments=5",
            "paper-static:fibers=7,segments=5,turned=0",
            "paper-dynamic:fibers=2,segments=5",
            "paper-dynamic:fibers=2,segments=5,frame=85",
            "paper-strand:fibers=2,segments=300",
            "paper-half-scalp:fibers=7,segments=25",
            "paper-dynamic:fibers=2,segments=5,turned=1",
            "paper-strand:fibers=2,segments=300,straight=1",
            f"paper-dynamic:fibers=2,segments=5,loads={LOADS}",  # its last state
        ):
            path = self.folder / "scene.vtp"
            self.run_program("generate", scene, "-o", path)
            texts.append(path.read_text(encoding="utf-8"))
        self.assertEqual(texts.pop(7), texts[6], "85 is the dynamic assembly's own frame")
        self.assertEqual(len(set(texts)), len(texts))

    def test_loads_are_of_all_scenes_that_are_generated(self):
        """Else a step would lead from one motion to another. Their path may hold commas."""
        loads = self.folder / "a,b:c=d.txt"
        loads.write_bytes(LOADS.read_bytes())
        scene = "paper-dynamic:fibers=2,segments=5,frame="
        step = ("check", scene + "9", "--end", scene + "9", "--loads", loads, "--exit-zero")
        self.assertIn("points move by 0 on average", self.run_program(*step))


class Info(ProgramTest):
    def test_counts_and_lengths(self):
        path = self.write("crossing.txt", CROSSING)
        found = json.loads(self.run_program("info", path, "-r", 0.1, "--json"))
        self.assertEqual(found["fibers"], 3)
        self.assertEqual(found["points"], 8)
        self.assertEqual(found["segments_per_fiber"], {"min": 1, "max": 3})
        self.assertEqual(found["length"], 6)
        self.assertEqual(found["fiber_length"], {"min": 1, "median": 2, "max": 3})
        self.assertEqual(found["segment_length"], {"min": 1, "median": 1, "max": 2})
        self.assertEqual(found["radius"], {"min": 0.1, "median": 0.1, "max": 0.1})
        self.assertEqual(found["bounds"], {"min": [0, -1, 0], "max": [3, 1, 50]})
        self.assertEqual(found["warnings"], [])
        self.assertAlmostEqual(found["contact_radius"], 0.005, delta=1e-12)
        text = self.run_program("info", path, "-r", 0.1)
        self.assertRegex(text, r"contact +begins at radius 0\.005\n")
        self.assertNotIn("warning", text)

    def test_where_contact_begins(self):
        """The radius that is suggested would be that of a fiber with itself, as it goes along."""
        yarn = self.write("yarn.txt", "".join(f"{0.1 * i} 0 0\n" for i in range(40)))
        self.assertIsNone(json.loads(self.run_program("info", yarn, "--json"))["contact_radius"])
        self.assertNotIn("begins", self.run_program("info", yarn))
        path = self.folder / "helix.txt"
        self.run_program("generate", "helix:fibers=12,segments=15", "-o", path)
        begin = json.loads(self.run_program("info", path, "--json"))["contact_radius"]
        self.run_program("check", path, "-r", 0.9999 * begin)
        self.run_program("check", path, "-r", 1.0001 * begin, code=1)

    def test_warns(self):
        """A user would trust what a broken file says."""
        path = self.write(
            "odd.txt", "0 0 0\n0 0 0\n1 0 0\n2 0 0\n3 0 0\n4 0 0\n90 0 0\n\n0 0 0\n0 1 0\n\n5 5 5\n"
        )
        text = self.run_program("info", path)
        self.assertRegex(text, r"radius +none")
        self.assertIsNone(json.loads(self.run_program("info", path, "--json"))["radius"])
        self.assertIn("radius zero", self.run_program("info", path, "-r", 0))
        for expected in (
            "one point or none, which touch nothing: 1",
            "length zero, whose points coincide: 1",
            "join two fibers: 1",
            "the file holds no radius",
            "begin at the same place as another one, and so touch it there, because the file tells "
            "no branch there: 1",
        ):
            self.assertIn(expected, text)
        self.assertIn("shorter than wide", self.run_program("info", path, "-r", 0.6))
        far = self.write("far.txt", "1e9 0 0\n1e9 1 0\n1e9 2 0\n")
        self.assertIn("million times its size", self.run_program("info", far, "-r", 0.1))

    def test_tapers_and_branches_are_told(self):
        """A neuron would be told to have hundreds of fibers that begin where another one does."""
        rows = [
            "1 1 0 0 0 4 -1",
            "2 3 5 0 0 1 1",
            "3 3 9 1 0 1 2",
            "4 3 9 -1 0 1 2",
            "5 3 9 0 1 1 2",
        ]
        path = self.write("n.swc", "\n".join(rows) + "\n")
        text = self.run_program("info", path)
        self.assertRegex(text, r"branches +3 fibers start at another one\n")
        self.assertRegex(text, r"tapers +1 segment, by up to 4 to 1\n")
        self.assertNotIn("begin at", text)
        told = json.loads(self.run_program("info", path, "--json"))
        self.assertEqual(told["tapers"], {"segments": 1, "largest_ratio": 4})
        self.assertEqual(
            told["branches"], {"fibers_that_start_at_others": 3, "fibers_that_end_at_others": 0}
        )
        # Each of the four fibers of a copy begins where one of the neuron does.
        copy = [f"1{row}" if row.endswith("-1") else f"1{row[:-1]}1{row[-1]}" for row in rows]
        twice = self.write("twice.swc", "\n".join(rows + copy) + "\n")
        self.assertIn("the file tells no branch there: 4\n", self.run_program("info", twice))
        # .vtp keeps all of it, and is told what is lost elsewhere.
        vtp = self.folder / "n.vtp"
        self.run_program("convert", path, vtp)
        self.assertEqual(self.run_program("info", vtp).replace("n.vtp", "n.swc"), text)
        for ending, format in ((".hair", ".hair"), (".txt", "text")):
            self.run_program("convert", path, self.folder / f"n{ending}")
            self.assertIn(f"{format} has no place for branches, samples and types", self.stderr)

    def test_numbers_too_large_to_compute_with(self):
        """The error would be that of a function that no user knows, without the file."""
        path = self.write("huge.txt", "1e308 0 0\n-1e308 0 0\n")
        other = self.write("other.txt", "0 0 0\n1 0 0\n")
        page = self.folder / "page.html"
        for command in (
            ("info", path),
            ("check", path, "-r", 1),
            ("check", other, "-r", 1, "--against", path),
            ("distance", path, "-r", 1),
            ("view", path, "-r", 1, "-o", page),
        ):
            self.run_program(*command, code=2)
            self.assertIn("'huge.txt': a coordinate of point 0 is too large", self.stderr)
        self.run_program("convert", path, self.folder / "huge.vtp")


STENOSIS = """<VTKFile type="PolyData"><PolyData><Piece NumberOfPoints="5" NumberOfLines="1">
<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">
0 0 0 10 0 0 20 0 0 30 0 0 40 0 0</DataArray></Points>
<PointData><DataArray type="Float64" Name="radius" format="ascii">3 3 0.5 3 3</DataArray>
</PointData>
<Lines><DataArray type="Int32" Name="connectivity" format="ascii">0 1 2 3 4</DataArray>
<DataArray type="Int32" Name="offsets" format="ascii">5</DataArray></Lines>
</Piece></PolyData></VTKFile>
"""


class Radii(ProgramTest):
    """A narrow place would vanish, or a radius that the file holds would be passed over."""

    def test_a_narrow_place_is_kept(self):
        path = self.write("stenosis.vtp", STENOSIS)
        out = self.folder / "out.vtp"
        for step in (path, out, self.folder / "out.hair"):
            self.run_program("convert", step, self.folder / "out.hair")
            self.run_program("convert", self.folder / "out.hair", out)
            self.assertEqual(read_vtp(out)[2]["radius"], [3, 3, 0.5, 3, 3])
        self.assertIn("radius          3\n", self.run_program("info", path))
        self.run_program("convert", path, out, "-r", 2)
        self.assertEqual(read_vtp(out)[2]["radius"], [2] * 5)
        neuron = self.write("n.swc", "1 1 0 0 0 3 -1\n2 3 1 0 0 .5 1\n3 3 2 0 0 3 2\n")
        self.run_program("convert", neuron, out)
        self.assertEqual(read_vtp(out)[2]["radius"], [3, 0.5, 3])

    def test_an_array_of_another_name(self):
        path = self.write("vessel.vtp", STENOSIS.replace("radius", "TubeRadius"))
        self.run_program("check", path, code=2)
        self.assertIn("--radius-from takes the radii from another array", self.stderr)
        self.assertIn("point data 'TubeRadius'", self.stderr)
        out = self.folder / "out.vtp"
        for command in (("check", path), ("distance", path), ("info", path)):
            self.run_program(*command, "--radius-from", "TubeRadius")
            self.assertNotIn("another array", self.stderr)
        self.run_program("convert", path, out, "--radius-from", "TubeRadius")
        self.assertNotIn("TubeRadius", self.stderr)
        self.assertEqual(read_vtp(out)[2]["radius"], [3, 3, 0.5, 3, 3])
        self.run_program("convert", path, out)
        self.assertIn("kept, and not: point data 'TubeRadius'", self.stderr)
        self.run_program("check", path, "--radius-from", "", code=2)
        self.assertIn("give the name of an array", self.stderr)
        self.run_program("check", path, "--radius-from", "Tube", code=2)
        self.assertIn("there is no array 'Tube'", self.stderr)
        self.run_program("check", path, "--radius-from", "TubeRadius", "-r", 1, code=2)
        self.assertIn("excludes", self.stderr)
        self.run_program("check", "cap:fibers=2", "--radius-from", "TubeRadius", code=2)
        self.assertIn("--radius-from is for files", self.stderr)
        zeros = self.write("zeros.vtp", STENOSIS.replace("3 3 0.5 3 3", "0 0 0 0 0"))
        self.run_program("check", zeros, code=2)
        self.assertIn("All radii are 0", self.stderr)

    def test_a_column_of_text(self):
        path = self.write("points.txt", "0 0 0 3\n1 0 0 .5\n2 0 0 3\n")
        out = self.folder / "out.vtp"
        self.run_program("check", path, code=2)
        self.assertIn("--radius-from 4 takes the radius", self.stderr)
        self.run_program("convert", path, out, "--radius-from", 4)
        self.assertEqual(read_vtp(out)[2]["radius"], [3, 0.5, 3])
        self.run_program("check", path, "--radius-from", 2, code=2)
        self.assertIn("--radius-from is '2'", self.stderr)
        path = self.write("groups_from.txt", "0 0 0\n1 0 0\n")
        self.run_program("check", path, "--groups-from", 4, code=2)
        self.assertIn("groups_from.txt', line 1: ", self.stderr)
        self.assertIn("--groups-from is 4", self.stderr)


class Packed(ProgramTest):
    def test_files_and_standard_input(self):
        """A user would have to unpack files first, or would not know what to do."""
        path = self.folder / "crossing.txt.gz"
        path.write_bytes(gzip.compress(CROSSING.encode()))
        self.assertIn("1 pair touches", self.run_program("check", path, "-r", 0.006, code=1))
        program = [PROGRAM, "check", "-", "-r", "0.006", "--json"]
        done = subprocess.run(program, input=path.read_bytes(), capture_output=True, check=False)
        self.assertEqual(json.loads(done.stdout)["contact_count"], 1, done.stderr)
        path.write_bytes(path.read_bytes()[:-9])
        self.run_program("check", path, "-r", 0.006, code=2)
        self.assertIn("truncated", self.stderr)
        self.run_program("generate", "cap:fibers=2", "-o", self.folder / "cap.vtp.gz", code=2)
        self.assertIn("pack it by gzip afterwards", self.stderr)
        self.assertEqual(self.files(), ["crossing.txt.gz"])

    def test_other_formats(self):
        legacy = self.write("lines.vtk", "# vtk DataFile Version 3.0\nlines\nASCII\n")
        mesh = self.write("mesh.obj", "v 0 0 0\n")
        for path, remedy in ((legacy, "save it as XML (.vtp)"), (mesh, "by --mesh")):
            for source in (path, "-"):
                program = [PROGRAM, "check", str(source), "-r", "1"]
                done = subprocess.run(
                    program, input=path.read_bytes(), capture_output=True, check=False
                )
                self.assertEqual(done.returncode, 2)
                self.assertIn(remedy, done.stderr.decode())


class BadUse(ProgramTest):
    def refused(self, *arguments, says):
        self.assertEqual(self.run_program(*arguments, code=2), "")
        self.assertIn(says, self.stderr)
        self.assertEqual(self.files(), [])

    def test_options_that_are_none(self):
        out = self.folder / "out.vtp"
        self.refused(says="subcommand")
        self.refused("frobnicate", "a", says="no command 'frobnicate'; fcl_fibers --help lists")
        self.refused("", says="no command ''")
        self.refused("check", says="SCENE")
        self.refused(
            "check", "helix", "--radius", -1, says="--radius: '-1' is not a number of 0 or more"
        )
        self.refused("check", "helix", "--radius", "wide", says="--radius")
        self.refused("check", "helix", "-n", "-3", says="--ignored-neighbors")
        self.refused("check", "helix", "--volumes", "kdops", says="--volumes")
        self.refused("check", "helix", "--csv", "--json", says="--csv")
        self.refused("generate", "helix", says="--output")
        self.refused("generate", "hair", "-o", out, says="neither a file nor a scene")
        self.refused("generate", "helix:fibres=7", "-o", out, says="no key 'fibres'")
        self.refused("generate", "helix:fibers=many", "-o", out, says="whole number")
        self.refused("generate", "helix:radius=wide", "-o", out, says="give a number")
        self.refused("generate", "helix:radius=-1", "-o", out, says="radius is -1")
        self.refused("generate", "helix:fibers", "-o", out, says="key=value")
        self.refused("check", "helix", "-r", 0.5, says="give helix:radius=0.5\n")
        self.refused("check", "helix:seed=2", "-r", 0.5, says="give helix:seed=2,radius=0.5\n")
        self.refused("view", "helix", "-r", 0.5, "-o", out, says="give helix:radius=0.5\n")
        self.refused("view", "helix", "-r", 1, "-r", 2, "-o", out, says="for 0 files;")
        self.refused("generate", "helix:fibers=1,fibers=2", "-o", out, says="twice")
        self.refused("generate", "helix:fibers=0", "-o", out, says="fibers")
        self.refused("generate", "paper-dynamic:fibers=1,frame=101", "-o", out, says="0 to 100")
        self.refused("view", "paper-dynamic:fibers=1,frames=9:3", "-o", out, says="FIRST:LAST")
        self.refused("view", "helix", "--loads", "a", "-o", out, says="'helix': only paper-dynamic")
        self.refused("check", "paper-dynamic", "--loads", "", says="loads '': the file cannot be")
        self.refused("check", "-", "--loads", "a", says="--loads is for generated scenes")
        self.refused("generate", "helix:fibers=2", "-o", self.folder / "a.obj", says=".vtp")

    def test_files_that_cannot_be_read_or_written(self):
        self.refused("check", self.folder, says="")
        nowhere = self.folder / "none" / "out.txt"
        self.refused("generate", "helix:fibers=2", "-o", nowhere, says="cannot be written")
        self.refused("generate", "helix:fibers=2", "-o", self.folder, says="directory")
        self.refused("check", "helix:fibers=2", "--csv", "-o", "/dev/full", says="writing failed")
        with open("/dev/full", "w", encoding="utf-8") as full:
            program = [PROGRAM, "info", "helix:fibers=2"]
            done = subprocess.run(
                program, stdout=full, stderr=subprocess.PIPE, text=True, check=False
            )
        self.assertEqual(done.returncode, 2)
        self.assertIn("stdout", done.stderr)

    def test_a_broken_file_is_named(self):
        broken = self.write("broken.vtp", "<VTKFile type='PolyData'><PolyData>")
        self.assertEqual(self.run_program("check", broken, code=2), "")
        self.assertIn("broken.vtp", self.stderr)

    def test_a_file_without_a_radius(self):
        """Fibers without thickness would pass for fibers that touch nothing."""
        path = self.write("crossing.txt", CROSSING)
        page = self.folder / "page.html"
        for command in (
            ("check", path),
            ("view", path, "-o", page),
            ("view", "helix:fibers=2", path, "-o", page),
            ("distance", path),
            ("check", "helix:fibers=2", "--against", path),
        ):
            self.assertEqual(self.run_program(*command, code=2), "")
            self.assertIn("crossing.txt': the file holds no radius", self.stderr)
            self.assertIn("give --radius R", self.stderr)
            self.assertEqual(self.files(), ["crossing.txt"])
        self.assertIn("0 pairs touch", self.run_program("check", path, "--radius", 0))
        self.run_program("view", path, "--radius", 0, "-o", page)

    def test_what_a_reader_warns_of(self):
        """A user would not know that a file is doubtful, whatever is asked of it."""
        cut = self.write("cut.txt", "0 0 0\n1 0 0\n\n0 5 0\n1 5 0")
        far = self.folder / "far.hair"  # floats that are 1 apart
        head = struct.pack("<4s4If", b"HAIR", 1, 2, 2, 1, 0.5).ljust(128, b"\0")
        far.write_bytes(head + struct.pack("<6f", 1e7, 0, 0, 1e7, 2, 0))
        out = self.folder / "out"
        for path, radius, warning in ((cut, ("-r", 0.1), "truncated"), (far, (), "coarse")):
            for command in (
                ("check", path),
                ("view", path, "-o", f"{out}.html"),
                ("distance", path),
                ("convert", path, f"{out}.vtp"),
            ):
                self.run_program(*command, *radius)
                self.assertIn(f"fcl_fibers: warning: {path.name}: ", self.stderr)
                self.assertEqual(self.stderr.count(warning), 1, command)
            self.assertIn(warning, self.run_program("info", path, *radius))
            self.assertEqual(self.stderr, "")

    def test_any_name_of_a_file(self):
        """A name in Latin-1 would end each answer in JSON and each page; an escape sequence would
        set the terminal."""
        name = b"caf\xe9 \x1b[2J\xc2\x9b\xed\xa0\x80\xf4\x90\x80\x80 \xc3\xa9\xf0\x9f\x98\x80"
        shown = "caf\ufffd ?[2J?" + 7 * "\ufffd" + " \u00e9\U0001f600"
        path = os.path.join(os.fsencode(self.folder), name + b".txt")
        mesh = os.path.join(os.fsencode(self.folder), name + b".obj")
        with open(path, "w", encoding="utf-8") as file:
            file.write(CROSSING)
        with open(mesh, "w", encoding="utf-8") as file:
            file.write(box((0.4, -0.1, -0.1), (0.6, 0.1, 0.1)))
        for command in (
            ("info", path, "--json"),
            ("check", path, "-r", 0.01, "--mesh", mesh, "--json", "--exit-zero"),
            ("check", path, "-r", 0.01, "--mesh", mesh, "--exit-zero"),
            ("check", path, "--end", path, "-r", 0.01, "--json", "--exit-zero"),
            ("distance", path, path, "-r", 0.01, "--json"),
            ("check", path, "-r", 9, "--limit", 1, "--exit-zero"),  # a warning
        ):
            out = self.run_program(*command)
            self.assertIn(shown + ".txt", out)
            self.assertNotIn("\x1b", out + self.stderr)
            if "--json" in command:
                json.loads(out)
        self.assertIn(f"warning: {shown}.txt: ", self.stderr)
        out = self.run_program("check", path, "-r", 0.01, "--mesh", mesh, "--exit-zero")
        self.assertIn(f"with {shown}.obj", out)
        page = self.folder / "page.html"
        self.run_program("view", path, "-r", 0.01, "--mesh", mesh, "-o", page)
        self.assertIn(f"<title>{shown}.txt", page.read_text(encoding="utf-8"))
        for command in ("check", path), ("check", path + b"no", "-r", 1), ("check", b"\xe9\x1b"):
            self.run_program(*command, code=2)
            self.assertNotIn("\x1b", self.stderr)
            self.assertIn("\ufffd", self.stderr)

    def test_help_reads_well(self):
        text = self.run_program("--help")
        for word in HELPED + ("paper-half-scalp", "frames=FIRST:LAST:STEP"):
            self.assertIn(word, text)
        for command in HELPED:
            text = self.run_program(command, "--help")
            named = {"convert": "file", "replay": "FILE"}.get(command, "SCENE")
            self.assertIn(named, text)
            if command == "check":
                for column in CONTACT_COLUMNS[:7]:
                    self.assertRegex(text, rf"\b{column}\b")
            self.assertLessEqual(max(map(len, text.splitlines())), 100)
        self.assertRegex(self.run_program("--version"), r"^\d+\.\d+\.\d+\n$")


# Two capsules that touch. BOX is that of the second one, as the program left it.
RECORD = """fcl_fibers record 1
double
DynamicAABBTreeCollisionManager
boxes 0 0 0 0 0 1 0
capsule 0 -1 -1 -2 1 1 2 0 0 0 2.5 1 2
object 0 0 1 0 0 0 0 1 0 0 0 0 1 0 -1 -1 -2 1 1 2
object 1 0 1 0 0 1 0 1 0 0 0 0 1 0 BOX
registerObjects 0 1
collideSelf 0
end
"""


class Replay(ProgramTest):
    """A user's record would be replayed as another one, or a damaged one be believed."""

    def replay(self, text, code):
        return self.run_program("replay", self.write("record.txt", text), code=code)

    def test_managers_that_agree(self):
        out = self.replay(RECORD.replace("BOX", "0 -1 -2 2 1 2"), 0)
        self.assertIn("calls     1 changes and 1 queries\n", out)
        self.assertIn("pairs     1 of the first, 1 of the second\n", out)
        self.assertIn("found     none\n", out)

    def test_managers_that_differ(self):
        out = self.replay(RECORD.replace("BOX", "9 -1 -2 11 1 2"), 1)
        self.assertIn("call 2, collideSelf: the first manager does not hand on the pair", out)
        self.assertIn("their boxes do not overlap: is computeAABB() missing?", out)
        self.assertIn("object 1: capsule at 1 0 0, its axis 0 0 1, getAABB() from", out)

    def test_another_manager(self):
        text = RECORD.replace("BOX", "0 -1 -2 2 1 2").replace("DynamicAABBTree", "SaP")
        self.assertIn("in place of SaPCollisionManager", self.replay(text, 0))

    def test_damaged_records(self):
        good = RECORD.replace("BOX", "0 -1 -2 2 1 2")
        for text, error in (
            (CROSSING, "record.txt:1: it is no record of this version"),
            (good[:-9], "the record is cut"),
            (good.replace("2.5 1 2", "2.5 1"), "record.txt:5: the shape has"),
            (good.replace("registerObjects 0 1", "registerObjects 0 2"), "record.txt:8: there is"),
            (good.replace("2.5", "2.5q"), "record.txt:5: '2.5q' is no number"),
            (good.replace("collideSelf", "collideNone"), "record.txt:9: there is no such query"),
            (good.replace("\ndouble", "\nint"), "record.txt:4: the scalar is neither"),
        ):
            self.assertEqual(self.replay(text, 2), "")
            self.assertIn(error, self.stderr)
        self.run_program("replay", self.folder / "none.txt", code=2)
        self.assertIn("none.txt:1: it cannot be read", self.stderr)


def masked(command, output):
    """Without the times."""
    output = re.sub(r"\bin [\d.e-]+ s$", "in # s", output, flags=re.MULTILINE)
    if "frames=" in command:
        output = re.sub(r"[\d.e-]+(?=  helix)", "#", output)
    return [" ".join(line.split()) for line in output.splitlines()]


class Document(ProgramTest):
    PAGE = SOURCES / "docs" / "program.md"
    PAGES = (PAGE, SOURCES / "docs" / "start.md")

    def test_commands_print_what_the_page_shows(self):
        """A reader would see another answer than the page's."""
        shutil.copy(SOURCES / "examples" / "crossing.txt", self.folder)
        path = f"{Path(PROGRAM).parent}:{os.environ['PATH']}"
        text = "".join(page.read_text(encoding="utf-8") for page in self.PAGES)
        blocks = re.findall(r"```console\n(.*?)```", text, re.DOTALL)
        self.assertGreater(len(blocks), 13)
        for block in blocks:
            for step in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
                command, shown = step.split("\n", 1)
                done = subprocess.run(
                    command,
                    shell=True,
                    cwd=self.folder,
                    env={**os.environ, "PATH": path},
                    stdout=subprocess.PIPE,
                    stderr=subprocess.STDOUT,
                    text=True,
                    check=False,
                )
                self.assertEqual(masked(command, done.stdout), masked(command, shown), command)

    def test_describes_every_command(self):
        """A reader would not know of one."""
        text = self.PAGE.read_text(encoding="utf-8")
        for command in HELPED:
            self.assertIn(f"| `{command}` |", text)


class Gallery(ProgramTest):
    PAGE = SOURCES / "docs" / "gallery.md"

    def test_scenes_touch_in_as_many_pairs_as_the_page_says(self):
        """The page would be about other scenes than the ones that it tells how to make."""
        text = " ".join(self.PAGE.read_text(encoding="utf-8").split())
        script = SOURCES / "docs" / "pictures" / "scenes.py"
        subprocess.run([sys.executable, "-B", script, self.folder], check=True)
        scenes = {
            "at every crossing, in {:,} pairs": ("knot.txt", "-r", 0.101, "-a", 0.35),
            "touches itself in {:,} pairs": ("tube.txt", "-r", 0.125, "-a", 0.4),
            "each other in {:,} pairs": ("parting.txt", "-r", 0.05),
            "in {:,} pairs at step 50": ("paper-dynamic:frame=50",),
            "in {:,} at step 75": ("paper-dynamic:frame=75",),
            "in {:,} at step 100": ("paper-dynamic:frame=100",),
        }
        for words, (scene, *options) in scenes.items():
            path = self.folder / scene if scene.endswith(".txt") else scene
            out = self.run_program("check", path, *options, "--summary", "--json", code=1)
            pairs = json.loads(out)["contact_count"]
            self.assertIn(words.format(pairs), text, scene)


class Completion(ProgramTest):
    SCRIPT = SOURCES / "tools" / "completion.bash"

    def complete(self, *words):
        """What bash offers for the last word."""
        script = 'source "$1"; shift; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _fcl_fibers "$1"'
        script += '; printf "%s\\n" "${COMPREPLY[@]}"'
        call = ["bash", "-c", script, "bash", str(self.SCRIPT), PROGRAM, *words]
        return subprocess.run(call, capture_output=True, text=True, check=True).stdout.split()

    def test_lists_commands_and_options(self):
        """A command or an option would be missing from what the shell offers."""
        self.assertEqual([w for w in self.complete("") if not w.startswith("-")], list(HELPED))
        self.assertEqual(self.complete("gen"), ["generate"])
        for command in HELPED:
            options = re.findall(r"(?<![\w`-])--?[a-z][a-z-]*", self.run_program(command, "--help"))
            self.assertGreater(len(options), 2)
            self.assertLessEqual(set(options), set(self.complete(command, "-")), command)
        self.assertEqual(self.complete("check", "hair.tfx", "--ex"), ["--exit-zero"])
        self.assertEqual(self.complete("view", "--ex"), [])


class ManyContacts(ProgramTest):
    """What docs/program.md says of scenes that touch too much."""

    def bundle(self, name, fibers):
        """Fibers of one segment, all in one place except that each is a little longer."""
        lines = (f"0 0 0\n{1 + 1e-6 * i} 0 0\n" for i in range(fibers))
        return self.write(name, "\n".join(lines))

    def markers(self, *arguments):
        page = self.folder / "page.html"
        self.run_program("view", *arguments, "-o", page)
        data = page.read_text(encoding="utf-8").split('class="fiber-viewer-data">', 1)[1]
        frames = json.loads(data.split("</script>", 1)[0])["scenes"][0]["frames"]
        return [len(base64.b64decode(frame["markers"]["times"])) // 4 for frame in frames]

    def test_a_page_marks_so_many(self):
        """A page would grow until no browser opens it."""
        scene = self.bundle("scene.txt", 450)  # 101,025 pairs
        self.assertEqual(self.markers(scene, "-r", 0.1), [100000])
        step = self.bundle("step.txt", 180)  # 16,110 pairs, in each of 33 frames
        frames = self.markers(step, "--end", step, "-r", 0.1)
        self.assertEqual(len(frames), 33)
        self.assertEqual(max(frames), 500000 // 33 + 1)

    def test_a_pair_takes_so_much_memory(self):
        """Who sets --limit by the memory would run out of it."""

        def bytes_with(pairs, *arguments):
            call = [PROGRAM, "check", scene, "-r", "0.1", "--limit", str(pairs), *arguments]
            with open(os.devnull, "w", encoding="utf-8") as nothing:
                process = subprocess.Popen(call, stdout=nothing, stderr=nothing)
                _, status, usage = os.wait4(process.pid, 0)
                process.returncode = os.waitstatus_to_exitcode(status)
            self.assertEqual(process.returncode, 1)
            return 1024 * usage.ru_maxrss

        scene = self.bundle("scene.txt", 800)  # 319,600 pairs
        few, many = 1000, 300000
        for arguments, most in (["--summary"], 24), (["--json"], 100):
            used = bytes_with(many, *arguments) - bytes_with(few, *arguments)
            self.assertLess(used / (many - few), most)


class WholeFiles(ProgramTest):
    def test_what_was_there_stays_where_writing_fails(self):
        path = self.write("scene.vtp", "as it was")
        self.run_program("generate", "helix:fibers=0", "-o", path, code=2)
        self.assertEqual(path.read_text(encoding="utf-8"), "as it was")
        self.assertEqual(self.files(), ["scene.vtp"])

    def test_nothing_is_left_of_what_was_interrupted(self):
        """Half a file would be taken for a whole one."""
        path = self.write("page.html", "as it was")
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            # What runs the tests may ignore the last one.
            process = subprocess.Popen(
                [PROGRAM, "view", "paper-half-scalp:fibers=20000", "-o", path],
                preexec_fn=lambda number=number: signal.signal(number, signal.SIG_DFL),
            )
            end = time.monotonic() + 30
            while len(self.files()) < 2 and time.monotonic() < end:
                time.sleep(0.01)
            self.assertEqual(len(self.files()), 2, "there is a draft beside it")
            process.send_signal(number)
            self.assertEqual(process.wait(timeout=30), -number)
            self.assertEqual(self.files(), ["page.html"])
            self.assertEqual(path.read_text(encoding="utf-8"), "as it was")

    def test_a_link_is_kept_and_its_target_replaced(self):
        target = self.write("target.txt", "")
        link = self.folder / "link.txt"
        link.symlink_to(target)
        self.run_program("generate", "helix:fibers=2", "-o", link)
        self.assertTrue(link.is_symlink())
        self.assertGreater(target.stat().st_size, 100)

    def test_progress_is_for_terminals(self):
        """A log would fill with it; a user would wait in the dark."""
        self.run_program("info", "helix:fibers=50")
        self.assertEqual(self.stderr, "")
        master, slave = os.openpty()
        process = subprocess.Popen(
            [PROGRAM, "info", "helix:fibers=50"], stdout=subprocess.DEVNULL, stderr=slave
        )
        os.close(slave)
        seen = b""
        try:
            while piece := os.read(master, 4096):
                seen += piece
        except OSError:  # the other end is closed
            pass
        self.assertEqual(process.wait(), 0)
        os.close(master)
        self.assertIn(b"\r\x1b[K", seen)
        self.assertTrue(seen.endswith(b"\r\x1b[K"), "the line is cleared in the end")


class Page(ProgramTest):
    def scenes_of(self, page):
        data = page.read_text(encoding="utf-8").split('class="fiber-viewer-data">', 1)[1]
        return json.loads(data.split("</script>", 1)[0])["scenes"]

    def test_opens_without_a_network(self):
        path = self.folder / "page.html"
        self.run_program("view", "helix:fibers=5,segments=9", "-o", path)
        text = path.read_text(encoding="utf-8")
        self.assertNotRegex(text, r"""(?:src|href)\s*=\s*["'](?:https?:)?//""")
        self.assertIn("<!doctype html>", text)
        self.assertEqual(stat.S_IMODE(path.stat().st_mode) & 0o400, 0o400)
        (scene,) = self.scenes_of(path)
        self.assertEqual((scene["fibers"], scene["segments"]), (5, 45))
        self.run_program("view", "helix:fibers=5,segments=9", "--fragment", "-o", path)
        self.assertNotIn("<html", path.read_text(encoding="utf-8"))

    def test_radii_are_of_files(self):
        """Fibers would be as thick as those of another scene."""
        thin, thick = (self.write(f"{n}.txt", "0 0 0\n1 0 0\n") for n in ("thin", "thick"))
        page = self.folder / "page.html"

        def radii(*arguments):
            self.run_program("view", *arguments, "-o", page)
            firsts = [base64.b64decode(scene["radii"])[:4] for scene in self.scenes_of(page)]
            return [round(struct.unpack("<f", first)[0], 6) for first in firsts]

        helix = "helix:fibers=2,segments=3"
        self.assertEqual(radii(thin, helix, thick, "-r", 0.25), [0.25, 0.0035, 0.25])
        self.assertEqual(
            radii("-r", 0.25, thin, helix + ",radius=0.125", thick, "-r", 0.5), [0.25, 0.125, 0.5]
        )
        self.run_program("view", thin, thick, *3 * ("-r", 1), "-o", page, code=2)
        self.assertIn("--radius is given 3 times for 2 files;", self.stderr)

    def test_a_name_cannot_break_out(self):
        """A file's name would be run as a script."""
        odd = self.write("<script>alert(1)<.txt", "0 0 0\n1 0 0\n")
        path = self.folder / "page.html"
        self.run_program("view", odd, "-r", 0.1, "-o", path)
        self.assertNotIn("<script>alert", path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    unittest.main()
