# SPDX-License-Identifier: BSD-3-Clause
"""Meshes beside the fibers of check, as a user meets them."""

import csv
import io
import json
import unittest

from program import CONTACT_COLUMNS, MESH_COLUMNS, ProgramTest, box, read_vtp

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
# Beside the box from 0 to 4: fiber 0 enters it from above, fiber 1 is wholly inside, fiber 2 lies
# on it, fiber 3 is far away.
BESIDE_BOX = """1 1 6
1 1 4.5
1 1 3.5

2 2 2
2 2 2.5

2 3 4.08
3 3 4.08

9 9 9
9 9 8
"""


class Mesh(ProgramTest):
    def setUp(self):
        super().setUp()
        self.fibers = self.write("fibers.txt", BESIDE_BOX)
        self.box = self.write("box.obj", box((0, 0, 0), (4, 4, 4)))

    def check(self, *arguments, code=1):
        arguments = ("-r", 0.1, *arguments)
        return self.run_program("check", self.fibers, "--mesh", self.box, *arguments, code=code)

    def json(self, *arguments, code=1):
        return json.loads(self.check(*arguments, "--json", code=code))

    def touching(self, *arguments, code=1):
        contacts = self.json(*arguments, code=code)["contacts"]
        return [(c["fiber_a"], c["number_a"]) for c in contacts]

    def test_lists_contacts_with_a_mesh(self):
        """A segment in the mesh would be missing, or in another place."""
        found = self.json()
        deep, flat = found["contacts"]
        # From the tip the segment has to move by 0.5 and the radius until it is above the box.
        self.assertEqual((deep["fiber_a"], deep["number_a"], deep["mesh"]), (0, 1, 0))
        self.assertAlmostEqual(deep["distance"], -0.6, delta=1e-12)
        self.assertAlmostEqual(deep["s"], 0.5, delta=1e-12)
        self.assertEqual([round(x, 9) for x in deep["normal"]], [0, 0, -1])
        self.assertEqual([round(x, 9) for x in deep["point_b"]], [1, 1, 4])
        self.assertAlmostEqual(sum(deep["weights"]), 1, delta=1e-12)
        self.assertIs(deep["solid"], False)
        self.assertEqual((flat["fiber_a"], flat["number_a"]), (2, 0))
        self.assertAlmostEqual(flat["distance"], -0.02, delta=1e-12)
        self.assertEqual((found["contact_count"], found["touching_segments"]), (2, 2))
        (mesh,) = found["meshes"]
        self.assertEqual((mesh["mesh"], mesh["triangles"], mesh["solid"]), ("box.obj", 12, False))
        self.assertEqual((mesh["touching_segments"], mesh["touching_fibers"]), (2, 2))
        self.assertEqual(mesh["least_distance"], deep["distance"])
        self.assertEqual(found["depths"][-1], {"from": 1, "to": None, "pairs": 1})
        self.assertEqual(sum(part["pairs"] for part in found["depths"]), 2)

    def test_csv_and_text_say_the_same(self):
        rows = list(csv.DictReader(io.StringIO(self.check("--csv"))))
        self.assertEqual(list(rows[0]), CONTACT_COLUMNS + MESH_COLUMNS)
        for row, contact in zip(rows, self.json()["contacts"], strict=True):
            self.assertEqual((row["fiber_b"], row["number_b"], row["t"]), ("", "", ""))
            for name in ("fiber_a", "number_a", "s", "distance", "mesh", "triangle", "solid"):
                self.assertEqual(float(row[name]), contact[name], name)
            self.assertEqual([float(row[f"weight_{k}"]) for k in range(3)], contact["weights"])
            for name in ("point_a", "point_b", "normal"):
                self.assertEqual([float(row[f"{name}_{k}"]) for k in "xyz"], contact[name])
        text = self.check()
        self.assertIn("\nwith box.obj: 12 triangles\n2 pairs touch: 2 segments of 2", text)
        self.assertIn("\nbox.obj touches 2 segments of 2 fibers\n", text)
        self.assertRegex(text, r"\n +0 +1 +box.obj +\d+ +-0.6\n +2 +0 +box.obj +\d+ +-0.02\n")
        self.assertRegex(text, r"\n +over 100 +1  #+\n")

    def test_fibers_and_meshes_are_in_one_list(self):
        """The deepest contacts would not be first, or be cut off."""
        with open(self.fibers, "a", encoding="utf-8") as file:
            file.write("\n9.1 9 9\n9.1 9 8\n")
        rows = list(csv.DictReader(io.StringIO(self.check("--csv"))))
        self.assertEqual([row["fiber_b"] for row in rows], ["", "4", ""])
        self.assertEqual([row["mesh"] for row in rows], ["0", "", "0"])
        self.assertEqual(self.touching("--top", 2), [(0, 1), (3, 0)])
        self.assertEqual(self.touching("--sort", "fiber"), [(0, 1), (2, 0), (3, 0)])
        self.assertEqual(self.touching("--sort", "fiber", "--top", 2), [(0, 1), (2, 0)])
        self.assertEqual(self.touching("--meshes-only"), [(0, 1), (2, 0)])
        self.assertIn("\n3 pairs touch: 4 segments of 4 fibers\n", self.check())
        summary = self.json("--summary")["fiber_pairs"]
        self.assertEqual(
            [(row["fiber_a"], row.get("fiber_b"), row.get("mesh")) for row in summary],
            [(0, None, 0), (3, 4, None), (2, None, 0)],
        )
        rows = list(csv.DictReader(io.StringIO(self.check("--csv", "--summary"))))
        self.assertEqual([row["mesh"] for row in rows], ["0", "", "0"])
        self.assertEqual([row["number_b"] for row in rows], ["", "0", ""])
        self.assertEqual([row["triangle"] == "" for row in rows], [False, True, False])
        self.assertRegex(self.check("--summary"), r"\n +3 +0 +fiber 4 +0 +1 +-0\.1( +\S+){3}\n")

    def test_the_inside_of_a_solid(self):
        """Hair wholly inside of the head would pass for free."""
        self.assertEqual(self.touching("--solid"), [(1, 0), (0, 1), (2, 0)])
        inside = self.json("--solid")["contacts"][0]
        self.assertIs(inside["solid"], True)
        self.assertAlmostEqual(inside["distance"], -2.1, delta=1e-9)
        self.assertIn("with box.obj: 12 triangles, solid\n", self.check("--solid"))
        open_box = self.write("open.obj", box((0, 0, 0), (4, 4, 4)).rsplit("f", 1)[0])
        arguments = ("check", self.fibers, "-r", 0.1, "--mesh", open_box, "--solid")
        self.run_program(*arguments, code=2)
        self.assertRegex(self.stderr, r"open\.obj': .*not watertight")

    def test_roots_meet_no_mesh(self):
        self.assertEqual(self.touching("--root-segments", 1), [(0, 1)])
        self.assertEqual(self.touching("--root-segments", 2, code=0), [])
        # The second segment of fiber 0 begins at 1.5.
        self.assertEqual(self.touching("--root-length", 1.5), [(0, 1)])
        self.assertEqual(self.touching("--root-length", 1.51, code=0), [])
        roots = ("--root-length", 0.1, "--root-segments", 2)
        self.assertEqual(self.touching(*roots, code=0), [])
        moved = self.write("moved.txt", BESIDE_BOX.replace("1 1 6", "1 1 4.6"))
        text = self.check(moved, "--root-length", 1.5, "--csv", "--exit-zero", code=0)
        frames = [row["frame"] for row in csv.DictReader(io.StringIO(text))]
        self.assertEqual(frames, ["0"], "the roots are those of each frame")

    def test_margin_counts(self):
        fibers = self.write("above.txt", "1 1 4.25\n2 1 4.25\n")
        arguments = ("check", fibers, "-r", 0.1, "--mesh", self.box, "--json")
        self.assertEqual(json.loads(self.run_program(*arguments))["contacts"], [])
        found = json.loads(self.run_program(*arguments, "--margin", 0.2, code=1))
        self.assertAlmostEqual(found["contacts"][0]["distance"], 0.15, delta=1e-12)

    def test_several_meshes(self):
        floor = self.write("floor.obj", "v 0 0 6\nv 9 0 6\nv 0 9 6\nf 1 2 3\n")
        found = self.json("--mesh", floor)
        self.assertEqual([m["touching_segments"] for m in found["meshes"]], [2, 1])
        contacts = [(c["fiber_a"], c["number_a"], c["mesh"]) for c in found["contacts"]]
        self.assertEqual(contacts, [(0, 1, 0), (0, 0, 1), (2, 0, 0)])
        self.assertIn("floor.obj touches 1 segment of 1 fiber\n", self.check("--mesh", floor))

    def test_against_another_scene(self):
        other = self.write("other.txt", "9 8 8.5\n9 10 8.5\n")
        found = self.json("--against", other)
        self.assertEqual([c.get("fiber_b") for c in found["contacts"]], [None, 0, None])
        self.assertEqual(found["against"]["touching_segments"], 1)

    def test_pictures(self):
        segments, contacts = self.folder / "segments.vtp", self.folder / "contacts.vtp"
        self.check("--write-segments", segments, "--write-contacts", contacts)
        self.assertEqual(read_vtp(segments)[3]["touching"], [0, 1, 0, 1, 0])
        points, _, _, data = read_vtp(contacts)
        self.assertEqual(data["fiber_b"], [4, 4], "a mesh is the fiber after the last one")
        contact = self.json("--sort", "fiber")["contacts"][0]
        self.assertEqual(data["number_b"][0], contact["triangle"])
        for k in range(3):
            middle = (contact["point_a"][k] + contact["point_b"][k]) / 2
            self.assertAlmostEqual(points[0][k], middle, delta=1e-12)

    def test_other_units_and_frames_are_warned_of(self):
        """Hair in metres beside a head in centimetres would touch nothing, without a word."""
        page = self.folder / "page.html"
        hair = "0 0 {0}\n0 0 {1}\n\n{1} 0 0\n{1} {1} 0\n"
        sizes, frames = "times as large as the", "boxes around them do not meet"
        for text, mesh, expected in (
            (hair.format(1, 2), box((-100, -100, -100), (100, 100, 100)), "meshes are about"),
            (hair.format(100, 200), box((0, 0, 0), (1, 1, 1)), "fibers are about"),
            (hair.format(1, 2), box((5, 5, 5), (9, 9, 9)), frames),
            (hair.format(1, 2), box((-10, -10, -10), (10, 10, 10)), None),
            (hair.format(1, 2), box((0, 0, 2.05), (2, 2, 4)), None),
            (hair.format(1, 2), box((0, 0, 2), (2, 2, 4)) + "v 900 0 0\n", None),
            (hair.format(1, 2), box((5, 5, 5), (9, 9, 9)) + "v 0 0 0\n", frames),
        ):
            fibers, obj = self.write("hair.txt", text), self.write("head.obj", mesh)
            both = (fibers, "-r", 0.1, "--mesh", obj)
            for command in (("check", *both, "--exit-zero"), ("view", *both, "-o", page)):
                self.run_program(*command)
                self.assertEqual(self.stderr.count("warning"), 0 if expected is None else 1)
                self.assertIn(expected or "", self.stderr)
                self.assertEqual(sizes in self.stderr, "about" in (expected or ""))
        obj = self.write("head.obj", box((100, 100, 100), (104, 104, 104)))
        self.run_program("check", "helix:fibers=2,frames=0:2", "--mesh", obj, "--exit-zero")
        self.assertEqual(self.stderr.count("boxes around"), 1, "of several frames, the first")

    def test_a_mesh_far_away_touches_nothing(self):
        far = self.write("far.obj", box((1e30, 0, 0), (2e30, 1, 1)))
        self.run_program("check", self.fibers, "-r", 0.1, "--mesh", far)
        farther = self.write("farther.obj", box((1e299, 0, 0), (2e299, 1, 1)))
        near = self.write("near.txt", "0 0 0\n1e-300 0 0\n")
        self.run_program("check", near, "-r", 1e-301, "--mesh", farther, code=2)
        self.assertIn("'farther.obj': ", self.stderr)

    def test_the_search_ends_at_the_limit(self):
        found = self.json("--limit", 1)
        self.assertIs(found["complete"], False)
        self.assertIn("--limit", self.stderr)


class ObjFile(ProgramTest):
    """The reader's own tests are tests/io/obj_test.cpp and polygon_test.cpp."""

    def test_what_is_wrong_is_told(self):
        mesh = self.write("head.obj", TRIANGLE.replace("f 1 2 3", "f 1 2 4"))
        self.run_program("check", "helix", "--mesh", mesh, code=2)
        self.assertIn("head.obj', line 4: the face has point 4, and the file has 3", self.stderr)
        self.run_program("check", "helix", "--mesh", self.folder / "none.obj", code=2)
        self.assertIn("none.obj' does not exist", self.stderr)


class Options(ProgramTest):
    def test_options_that_do_not_fit(self):
        mesh = self.write("mesh.obj", TRIANGLE)
        for option in (["--solid"], ["--root-length", 1], ["--root-segments", 1]):
            self.run_program("check", "helix", *option, code=2)
            self.assertIn(f"{option[0]} requires --mesh", self.stderr)
        scene = ("check", "helix:fibers=2", "--mesh", mesh)
        self.run_program(*scene, "--report", "volumes", code=2)
        self.assertIn("without --report volumes", self.stderr)
        self.run_program(*scene, "--meshes-only", "--against", "helix", code=2)
        self.assertIn("--meshes-only", self.stderr)
        self.run_program(*scene, "--root-length", -1, code=2)
        self.run_program(*scene, "--root-segments", -1, code=2)


if __name__ == "__main__":
    unittest.main()
