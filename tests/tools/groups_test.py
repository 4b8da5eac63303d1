# SPDX-License-Identifier: BSD-3-Clause
"""Several scenes as groups or frames of one, and groups by numbers in a file."""

import collections
import csv
import io
import json
import random
import unittest

from program import ProgramTest

SIDES = ("a", "b")


def text_of(fibers, label=""):
    lines = ("\n".join(" ".join(map(str, p)) + label for p in fiber) for fiber in fibers)
    return "\n\n".join(lines) + "\n"


class Groups(ProgramTest):
    """Contacts within a bundle would be taken for those between two, or fibers for others."""

    def setUp(self):
        super().setUp()
        chance = random.Random(20)
        self.fibers = []
        for count in (15, 20):
            starts = [[chance.uniform(0, 6) for _ in range(3)] for _ in range(count)]
            ways = [[chance.uniform(-1, 1) for _ in range(3)] for _ in range(count)]
            self.fibers.append(
                [
                    [tuple(round(p + i * w, 4) for p, w in zip(start, way)) for i in range(7)]
                    for start, way in zip(starts, ways)
                ]
            )
        self.a, self.b = (
            self.write(name, text_of(fibers))
            for name, fibers in zip(("a.txt", "b.txt"), self.fibers)
        )

    def rows(self, *arguments):
        """How often each contact is found: the group, fiber and number of both sides, and how far
        apart they are."""
        text = self.run_program("check", *arguments, "--csv", code=1)
        sides = [f"{name}_{side}" for side in SIDES for name in ("group", "fiber", "number")]
        return collections.Counter(
            (*(int(row.get(name) or 0) for name in sides), round(float(row["distance"]), 9))
            for row in csv.DictReader(io.StringIO(text))
        )

    def between(self, *radii):
        found = self.rows(self.a, "--against", self.b, *radii)
        return collections.Counter(
            {(0, *row[1:3], 1, *row[4:]): times for row, times in found.items()}
        )

    def test_files_are_groups(self):
        for radii in (("-r", 0.2), ("-r", 0.1, "-r", 0.3), ("-r", 0.3, "-r", 0.1)):
            expected = self.between(*radii)
            self.assertGreater(len(expected), 5)
            self.assertEqual(self.rows(self.a, self.b, "--groups", *radii), expected)

    def test_pairs_within_groups_may_count(self):
        radii = ("-r", 0.1, "-r", 0.3)
        expected = self.between(*radii) + self.rows(self.a, *radii[:2])
        for row, times in self.rows(self.b, *radii[2:]).items():
            expected[1, *row[1:3], 1, *row[4:]] = times
        self.assertEqual(self.rows(self.a, self.b, "--groups", "--within", *radii), expected)

    def test_a_column_tells_groups(self):
        both = self.write(
            "both.txt", "\n".join(text_of(f, f" {n}") for f, n in zip(self.fibers, (9, 4)))
        )
        expected = {(9, *row[1:3], 4, row[4] + 15, *row[5:]) for row in self.between("-r", 0.2)}
        self.assertEqual(set(self.rows(both, "--groups-from", 4, "-r", 0.2)), expected)
        found = json.loads(
            self.run_program("check", both, "--groups-from", 4, "-r", 0.2, "--json", code=1)
        )
        self.assertEqual(
            found["groups"],
            [
                {"group": 4, "fibers": 20, "segments": 120},
                {"group": 9, "fibers": 15, "segments": 90},
            ],
        )
        (pair,) = found["group_pairs"]
        self.assertEqual((pair["group_a"], pair["group_b"]), (4, 9))
        self.assertEqual(pair["contact_count"], len(expected))
        self.assertEqual(pair["least_distance"], found["least_distance"])
        self.assertEqual({(c["group_a"], c["group_b"]) for c in found["contacts"]}, {(9, 4)})

    def test_text_tells_groups(self):
        text = self.run_program("check", self.a, self.b, "--groups", "-r", 0.2, code=1)
        self.assertIn("\ngroup 0, a.txt: 90 segments of 15 fibers\ngroup 1, b.txt: 120 s", text)
        self.assertNotIn("groups 0 and 1:", text, "the line of all pairs tells it")
        first = next(line for line in text.splitlines() if line.endswith(" 0        1"))
        number, distance = len(self.between("-r", 0.2)), float(first.split()[4])
        self.assertIn(f"\n{number} pairs touch: ", text)
        self.assertEqual(tuple(map(int, first.split()[:4])), self.deepest(distance))
        within = self.run_program(
            "check", self.a, self.b, "--groups", "--within", "-r", 0.2, code=1
        )
        self.assertIn(f"\ngroups 0 and 1: {number} pairs\n", within)
        many = self.write("many.txt", "\n".join(f"{i} 0 0 {i}\n{i} 1 0 {i}\n" for i in range(12)))
        text = self.run_program("check", many, "--groups-from", 4, "-r", 0.6, code=1)
        self.assertIn("\ngroup 9: 1 segment of 1 fiber\nand 2 more groups\n", text)
        self.assertIn("\ngroups 9 and 10: 1 pair\nand 1 more pairs of groups\n", text)

    def deepest(self, distance):
        """Fibers and numbers of the contact that is the deepest."""
        row = min(self.between("-r", 0.2), key=lambda row: row[-1])
        self.assertAlmostEqual(row[-1], distance, places=4)
        return (*row[1:3], *row[4:6])

    def test_the_first_of_several_moves(self):
        scene = "paper-dynamic:fibers=20,segments=20,frames=0:50:25"
        still = "paper-dynamic:fibers=10,segments=20,seed=9,frame=30"
        grouped = self.run_program("check", scene, still, "--groups", "--json", code=1)
        expected = self.run_program("check", scene, "--against", still, "--json", code=1)
        frames = [json.loads(text)["frames"] for text in (grouped, expected)]
        self.assertGreater(frames[0][2]["contact_count"], 0)
        for mine, other in zip(*frames):
            self.assertEqual(mine["frame"], other["frame"])
            self.assertEqual(mine["contact_count"], other["contact_count"])
            self.assertAlmostEqual(mine["least_distance"], other["least_distance"], places=12)

    def test_neurons_keep_branches_samples_and_radii(self):
        """Segments that meet where a neuron branches would be contacts."""
        lines = ("1 1 {0} 0 0 {1} -1", "2 3 {0} 5 0 1 1", "3 3 {0} 9 4 1 2", "4 2 {0} 9 -4 1 2")
        near, far = (
            self.write(f"{n}.swc", "\n".join(lines).format(*place) + "\n")
            for n, place in (("near", (0, 1)), ("far", (1.5, 3)))
        )
        for scene in (near, far):
            self.run_program("check", scene)
        grouped = self.rows(near, far, "--groups", "--within")
        self.assertEqual(set(grouped), set(self.rows(near, far, "--groups")))
        self.assertEqual(sum(grouped.values()), sum(self.rows(near, "--against", far).values()))
        header = self.run_program("check", near, far, "--groups", "--csv", code=1).split("\n")[0]
        self.assertTrue(
            header.endswith(",normal_z,group_a,group_b,sample_a,type_a,sample_b,type_b")
        )
        types = ("--groups-from", "type", "-r", 3, "--ignored-neighbors", 0)
        groups = {(row[0], row[3]) for row in self.rows(near, *types)}
        self.assertEqual(groups, {(3, 2)})

    def test_a_mesh_is_met_by_all_groups(self):
        floor = self.write("floor.obj", "v 0 0 3\nv 6 0 3\nv 6 6 3\nv 0 6 3\nf 1 2 3 4\n")
        mesh = ("--mesh", floor, "--json", "-r", 0.1)

        def touching(*scenes):
            found = json.loads(self.run_program("check", *scenes, *mesh, code=1))
            return [
                (c.get("group_a"), c["fiber_a"], c["number_a"])
                for c in found["contacts"]
                if "mesh" in c
            ]

        expected = [(g, *c[1:]) for g, f in ((0, self.a), (1, self.b)) for c in touching(f)]
        self.assertEqual(sorted(touching(self.a, self.b, "--groups")), sorted(expected))

    def test_a_page_has_groups(self):
        scene = self.page_of(self.a, self.b, "--groups", "-r", 0.2)
        groups = [
            {"name": "a.txt", "first": 0, "fibers": 15},
            {"name": "b.txt", "first": 15, "fibers": 20},
        ]
        self.assertEqual((scene["title"], scene["groups"]), ("a.txt, b.txt", groups))
        number = sum(self.between("-r", 0.2).values())
        self.assertEqual(scene["frames"][0]["contacts"], number)
        within = self.page_of(self.a, self.b, "--groups", "--within", "-r", 0.2)
        self.assertGreater(within["frames"][0]["contacts"], number)
        self.assertEqual(within["groups"], groups)

    def test_a_page_plays_files(self):
        """Frames of a simulation would be shown one by one."""
        moved = self.write("moved.txt", text_of([[(x, y, z + 9) for x, y, z in self.fibers[0][0]]]))
        first = self.write("first.txt", text_of(self.fibers[0][:1]))
        scene = self.page_of(first, moved, "--frames", "-r", 0.2)
        self.assertEqual([f["label"] for f in scene["frames"]], ["frame 0", "frame 1"])
        self.assertEqual((scene["title"], scene["opened"]), ("first.txt, moved.txt", 0))
        self.assertNotEqual(*(f["points"] for f in scene["frames"]))

    def test_what_cannot_be_grouped(self):
        page = self.folder / "page.html"
        for arguments, error in (
            ((self.a, "--groups"), "--groups takes two or more scenes"),
            ((self.a, "--within"), "give --groups or --groups-from, too"),
            ((self.a, self.b, "--groups", "--groups-from", 4), "excludes"),
            ((self.a, "--groups-from", 4), "there are 3 columns; --groups-from is 4"),
            ((self.a, "--groups-from", ""), "give the name of an array"),
            (("helix:fibers=2", "--groups-from", 4), "--groups-from is for files"),
            ((self.a, self.b, "--groups", "--end", self.b), "excludes"),
        ):
            for command in (("check",), ("view", "-o", page)):
                radius = () if "helix:fibers=2" in arguments else ("-r", 1)
                self.run_program(*command, *arguments, *radius, code=2)
                self.assertIn(error, self.stderr)
        self.run_program("check", self.a, "--groups", "--against", self.b, "-r", 1, code=2)
        for arguments, error in (
            ((self.a, "--frames"), "--frames takes two or more scenes"),
            ((self.a, self.b, "--frames"), "'b.txt' cannot be a frame after 'a.txt'"),
        ):
            self.run_program("view", *arguments, "-r", 1, "-o", page, code=2)
            self.assertIn(error, self.stderr)
        self.assertFalse(page.exists())


if __name__ == "__main__":
    unittest.main()
