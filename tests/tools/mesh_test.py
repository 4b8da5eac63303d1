# SPDX-License-Identifier: BSD-3-Clause
"""Meshes beside the fibers of check, as a user meets them."""

import csv
import io
import json
import math
import os
import random
import unittest

from program import CONTACT_COLUMNS, MESH_COLUMNS, ProgramTest, box, read_polylines, read_vtp

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
        return [(c["fiber_a"], c["segment_a"]) for c in contacts]

    def test_lists_contacts_with_a_mesh(self):
        """A segment in the mesh would be missing, or in another place."""
        found = self.json()
        deep, flat = found["contacts"]
        # From the tip the segment has to move by 0.5 and the radius until it is above the box.
        self.assertEqual((deep["fiber_a"], deep["segment_a"], deep["mesh"]), (0, 1, 0))
        self.assertAlmostEqual(deep["distance"], -0.6, delta=1e-12)
        self.assertAlmostEqual(deep["s"], 0.5, delta=1e-12)
        self.assertEqual([round(x, 9) for x in deep["normal"]], [0, 0, -1])
        self.assertEqual([round(x, 9) for x in deep["point_b"]], [1, 1, 4])
        self.assertAlmostEqual(sum(deep["weights"]), 1, delta=1e-12)
        self.assertIs(deep["solid"], False)
        self.assertEqual((flat["fiber_a"], flat["segment_a"]), (2, 0))
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
            self.assertEqual((row["fiber_b"], row["segment_b"], row["t"]), ("", "", ""))
            for name in ("fiber_a", "segment_a", "s", "distance", "mesh", "triangle", "solid"):
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
        self.assertRegex(self.check("--summary"), r"\n +3 +fiber 4 +1 +-0\.1\n")

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
        contacts = [(c["fiber_a"], c["segment_a"], c["mesh"]) for c in found["contacts"]]
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
        self.assertEqual(data["segment_b"][0], contact["triangle"])
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

    def test_agrees_with_brute_force(self):
        """Contacts of hair that lies on a mesh of many triangles would be missing."""
        random.seed(3)
        heights = [[0.3 * random.random() for _ in range(5)] for _ in range(5)]
        points = [(x, y, heights[x][y]) for x in range(5) for y in range(5)]
        at = [5 * x + y for x in range(4) for y in range(4)]
        triangles = [t for i in at for t in ((i, i + 5, i + 6), (i, i + 6, i + 1))]
        lines = [f"v {x} {y} {z}" for x, y, z in points]
        lines += ["f " + " ".join(str(i + 1) for i in t) for t in triangles]
        mesh = self.write("hills.obj", "\n".join(lines) + "\n")
        hair = self.write(
            "hair.txt",
            "\n\n".join(
                "\n".join(
                    f"{i} {random.uniform(0, 4)} {random.uniform(0.1, 0.4)}" for i in range(5)
                )
                for _ in range(20)
            ),
        )
        radius, expected = 0.1, {}
        for f, fiber in enumerate(read_polylines(hair)):
            for s, (p, q) in enumerate(zip(fiber, fiber[1:])):
                distance = min(
                    to_triangle(p, q, *(points[i] for i in triangle)) for triangle in triangles
                )
                self.assertGreater(abs(distance - radius), 1e-6, "the seed decides nothing")
                if distance < radius:
                    expected[f, s] = distance - radius
        self.assertGreater(len(expected), 10)
        arguments = ("check", hair, "-r", radius, "--mesh", mesh, "--meshes-only", "--json")
        contacts = json.loads(self.run_program(*arguments, code=1))["contacts"]
        found = {(c["fiber_a"], c["segment_a"]): c["distance"] for c in contacts}
        self.assertEqual(set(found), set(expected))
        self.assertEqual(len(contacts), len(expected))
        for place, distance in expected.items():
            if distance > -0.99 * radius:  # else the axis may cross the mesh
                self.assertAlmostEqual(found[place], distance, delta=1e-6)


class ObjFile(ProgramTest):
    """The reader's own tests are tests/io/obj_test.cpp and polygon_test.cpp."""

    def refused(self, text, says):
        mesh = self.write("head.obj", text)
        fibers = self.write("fibers.txt", "0 0 0\n1 0 0\n")
        self.run_program("check", fibers, "-r", 0.1, "--mesh", mesh, code=2)
        self.assertRegex(self.stderr, rf"head\.obj', {says}")

    def touching(self, text, fibers):
        """The number of triangles, and the fibers that touch one."""
        mesh = self.write("mesh.obj", text)
        fibers = self.write("fibers.txt", fibers)
        arguments = ("check", fibers, "-r", 0.01, "--mesh", mesh, "--exit-zero", "--json")
        found = json.loads(self.run_program(*arguments))
        return found["meshes"][0]["triangles"], {c["fiber_a"] for c in found["contacts"]}

    def test_what_is_wrong_is_told(self):
        """A mesh would lose a part of it, and fibers would pass there."""
        points = TRIANGLE.split("f")[0]
        self.refused("", "line 1: there is no face")
        self.refused(points + "f 1 2 4\n", "line 4: the face has point 4, and the file has 3")
        self.refused("v 0 0 0\nv nan 0 0\n", "line 2: 'nan' is no finite number")
        bow_tie = "v 0 0 0\nv 1 1 0\nv 1 0 0\nv 0 1 0\nf 1 2 3 4\n"
        self.refused(bow_tie, "line 5: the face crosses itself; .*cut its faces into triangles")
        self.refused("v \x1b[2J" + 3000000 * "A" + " 0 0", r"line 1: '\?\[2JA+\.\.\.' is no finite")
        self.assertLess(len(self.stderr), 500)
        self.run_program("check", "helix", "--mesh", self.folder / "none.obj", code=2)
        self.assertIn("none.obj' does not exist", self.stderr)
        self.run_program("check", "helix", "--mesh", self.folder, code=2)
        self.assertIn("is a directory", self.stderr)
        os.mkfifo(self.folder / "pipe.obj")
        self.run_program("check", "helix", "--mesh", self.folder / "pipe.obj", code=2)
        self.assertIn("pipe.obj' is not a regular file", self.stderr)

    def test_what_programs_write_is_read(self):
        points = "v 0 0 0 1.0\nv +1 0 0 0.5 0.5 0.5# a corner\n\tv 0 \\\n1e0 .0\n"
        for face in ("1 2 3", "-3 -2 -1", "1/7 2/7 3/7", "1// 2// 3// # a face", "1 2 \\\n3"):
            more = "mtllib none.mtl\nusemtl a\\b\nvn 0 0 1\nvt 0 0\no a\ng b\ns 1\n"
            text = f"\ufeff# a triangle\n{points}{more}f {face}\nl 1 2 # x\np 1\n"
            for end in ("\n", "\r\n", "\r"):
                found = self.touching(text.replace("\n", end), "0 0 0\n1 0 0\n")
                self.assertEqual(found, (1, {0}))
        point = "v 0 0 0\n" * 5 + "f 1 2 3 4 5\n"
        self.assertEqual(self.touching(point, "0 0 0\n1 0 0\n"), (3, {0}))

    def test_a_notch_of_a_face_is_open(self):
        """Hair behind a doorway would touch the wall in which it is."""
        notch = ((-2, -2), (2, -2), (2, 2), (0, -1), (-2, 2))
        dart = ((0, 10), (-1, 0), (0, 1), (1, 0))
        doorway = ((0, 0), (3, 0), (3, 4), (5, 4), (5, 0), (10, 0), (10, 8), (0, 8))
        window = ((0, 0), (9, 0), (9, 9), (0, 9), (0, 0), (3, 3), (3, 6), (6, 6), (6, 3), (3, 3))
        for outline, inside, outside in (
            (notch, ((-1.5, 0), (1.5, 1), (0, -1.5)), ((0, 0), (0, 1), (0.5, 0.5), (-0.5, 0.5))),
            (dart, ((0, 2), (-0.5, 1)), ((0, 0.5), (0.5, 0.3))),
            (doorway, ((1, 1), (4, 6), (8, 2)), ((4, 2), (3.5, 3.5))),
            (window, ((1, 4), (8, 8), (4, 1)), ((4, 4), (5, 5.5))),
        ):
            fibers = "".join(f"{x} {y} -1\n{x} {y} 1\n\n" for x, y in inside + outside)
            for corners in (outline, outline[::-1]):
                for start in range(len(corners)):
                    turned = corners[start:] + corners[:start]
                    text = "".join(f"v {x} {y} 0\n" for x, y in turned)
                    text += "f " + " ".join(str(i + 1) for i in range(len(turned))) + "\n"
                    found = self.touching(text, fibers)
                    self.assertEqual(found, (len(turned) - 2, set(range(len(inside)))), text)


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


def to_triangle(p, q, a, b, c):
    """The least distance of a segment and a triangle, which is convex along the segment."""

    def at(s):
        return point_to_triangle([x + s * (y - x) for x, y in zip(p, q)], a, b, c)

    low, high = 0.0, 1.0
    for _ in range(40):
        s, t = low + (high - low) / 3, high - (high - low) / 3
        low, high = (low, t) if at(s) <= at(t) else (s, high)
    return at((low + high) / 2)


def point_to_triangle(x, a, b, c):
    """Straight above the triangle its plane is nearest, else an edge."""
    u, v, w = ([i - j for i, j in zip(end, a)] for end in (b, c, x))
    uu, uv, vv, wu, wv = (
        sum(map(lambda i, j: i * j, *d)) for d in ((u, u), (u, v), (v, v), (w, u), (w, v))
    )
    scale = uu * vv - uv * uv
    s, t = (vv * wu - uv * wv) / scale, (uu * wv - uv * wu) / scale
    if min(s, t, 1 - s - t) >= 0:
        return math.dist(w, [s * i + t * j for i, j in zip(u, v)])
    return min(point_to_segment(x, *edge) for edge in ((a, b), (b, c), (c, a)))


def point_to_segment(x, p, q):
    d = [j - i for i, j in zip(p, q)]
    t = sum(i * (k - j) for i, j, k in zip(d, p, x)) / sum(i * i for i in d)
    t = min(1, max(0, t))
    return math.dist(x, [i + t * j for i, j in zip(p, d)])


if __name__ == "__main__":
    unittest.main()
