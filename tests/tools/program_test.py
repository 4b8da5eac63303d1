# SPDX-License-Identifier: BSD-3-Clause
"""The program fcl_fibers, as a user meets it."""

import base64
import csv
import io
import json
import math
import os
import re
import signal
import stat
import struct
import subprocess
import time
import unittest
from pathlib import Path

from program import PROGRAM, ProgramTest, read_polylines, read_vtp

# Fiber 1 crosses fiber 0 in the middle of its second segment, 0.01 above; fiber 2 is far away.
CROSSING = """# three fibers
0 0 0
1 0 0
2 0 0
3 0 0

1.5 -1 0.01
1.5 1 0.01

0 0 50
0 1 50
"""
SEGMENTS = ("fiber_a", "segment_a", "fiber_b", "segment_b")
CONTACT_COLUMNS = [
    *("fiber_a", "segment_a", "s", "fiber_b", "segment_b", "t", "distance"),
    *(f"{name}_{axis}" for name in ("point_a", "point_b", "normal") for axis in "xyz"),
]
HELPED = ("generate", "convert", "info", "check", "distance", "bench", "view")


class Check(ProgramTest):
    def setUp(self):
        super().setUp()
        self.fibers = self.write("crossing.txt", CROSSING)

    def contacts(self, *arguments):
        text = self.run_program("check", *arguments, "--csv", code=1)
        return list(csv.DictReader(io.StringIO(text)))

    def segments(self, *arguments):
        return [tuple(int(row[k]) for k in SEGMENTS) for row in self.contacts(*arguments)]

    def test_lists_the_contact_as_csv(self):
        """A contact would be missing, or named wrongly."""
        (row,) = self.contacts(self.fibers, "-r", 0.006)
        self.assertEqual(list(row), CONTACT_COLUMNS)
        found = [float(row[name]) for name in CONTACT_COLUMNS]
        point_a, point_b, normal = (1.5, 0, 0.006), (1.5, 0, 0.004), (0, 0, 1)
        expected = [0, 1, 0.5, 1, 0, 0.5, -0.002, *point_a, *point_b, *normal]
        for name, one, other in zip(CONTACT_COLUMNS, found, expected):
            self.assertAlmostEqual(one, other, delta=1e-15, msg=name)

    def test_lists_the_contact_as_json(self):
        found = json.loads(self.run_program("check", self.fibers, "-r", 0.006, "--json", code=1))
        self.assertEqual(found["contact_count"], 1)
        self.assertEqual((found["fibers"], found["segments"]), (3, 5))
        self.assertEqual(found["touching_segments"], 2)
        (contact,) = found["contacts"]
        (row,) = self.contacts(self.fibers, "-r", 0.006)
        flat = {}
        for name, value in contact.items():
            axes = zip("xyz", value) if isinstance(value, list) else [("", value)]
            flat.update({name + (axis and "_" + axis): number for axis, number in axes})
        self.assertEqual(flat, {name: float(value) for name, value in row.items()})

    def test_tells_by_its_exit_code(self):
        """A script could not tell contacts from none, or from an error."""
        self.assertIn("0 pairs touch", self.run_program("check", self.fibers, "-r", 0.004))
        self.assertIn("1 pair touches", self.run_program("check", self.fibers, "-r", 0.006, code=1))
        self.run_program("check", self.folder / "none.txt", code=2)

    def test_one_is_no_plural(self):
        text = self.run_program("check", self.fibers, "-r", 0.006, code=1)
        self.assertIn(": 5 segments of 3 fibers\n1 pair touches: 2 segments of 2 fibers\n", text)
        bent = self.write("bent.txt", "0 0 0\n1 0 0\n1 1 0\n")
        text = self.run_program("check", bent, "-r", 0.1)
        self.assertIn(": 2 segments of 1 fiber\n0 pairs touch: 0 segments of 0 fibers\n", text)
        straight = self.write("straight.txt", "0 0 0\n1 0 0\n")
        self.assertIn(": 1 segment of 1 fiber\n", self.run_program("check", straight, "-r", 0.1))

    def test_margin_neighbors_and_volumes(self):
        thin = (self.fibers, "--radius", 0.004)
        self.run_program("check", *thin, "--csv")
        self.assertEqual(len(self.contacts(*thin, "--margin", 0.003)), 1)
        adjacent = self.segments(*thin, "--ignored-neighbors", 0)
        self.assertEqual(adjacent, [(0, 0, 0, 1), (0, 1, 0, 2)])
        # Between the first segment and the third lies one unit.
        for length, count in ((0.99, 1), (1, 0)):
            near = ("--ignored-neighbors", 0, "--ignored-arc-length", length, "--margin", 0.993)
            segments = self.segments(*thin, *near)
            self.assertEqual(segments.count((0, 0, 0, 2)), count)
            self.assertEqual(segments.count((0, 0, 0, 1)), 0)
        found = json.loads(self.run_program("check", self.fibers, "-r", 0.004, "-a", 0.5, "--json"))
        self.assertEqual((found["ignored_neighbors"], found["ignored_arc_length"]), (1, 0.5))
        by_sphere = self.contacts(*thin, "--report", "volumes", "--volumes", "spheres")
        self.assertEqual(len(by_sphere), 3)  # fiber 1's reaches all of fiber 0

    def test_a_closed_fiber_is_its_own_neighbor_at_the_end(self):
        """The joint of a ring would be taken for a contact."""
        ring = self.write("ring.txt", "0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 0\n")
        self.run_program("check", ring, "-r", 0.1)
        self.assertEqual(len(self.contacts(ring, "-r", 0.1, "-n", 0)), 4)

    def test_agrees_with_brute_force(self):
        """Contacts of a denser scene would be wrong."""
        path = self.folder / "helix.txt"
        self.run_program("generate", "helix:fibers=12,segments=15", "-o", path)
        fibers = read_polylines(path)
        self.assertEqual([len(f) for f in fibers], [16] * 12)
        segments = [(f, s, fibers[f][s], fibers[f][s + 1]) for f in range(12) for s in range(15)]
        radius, expected = 0.04, set()
        for i, (f, s, p, q) in enumerate(segments):
            for g, t, u, v in segments[i + 1 :]:
                if f == g and t - s <= 1:
                    continue
                if segment_distance(p, q, u, v) <= 2 * radius:
                    expected.add((f, s, g, t))
        self.assertGreater(len(expected), 20)
        for options in ([], ["--volumes", "spheres"], ["--topology", "super-thread"]):
            rows = self.contacts(path, "-r", radius, *options)
            self.assertEqual({tuple(int(row[k]) for k in SEGMENTS) for row in rows}, expected)
            self.assertEqual(len(rows), len(expected))
            for row in rows:
                f, s, g, t = (int(row[k]) for k in SEGMENTS)
                exact = segment_distance(*fibers[f][s : s + 2], *fibers[g][t : t + 2])
                self.assertAlmostEqual(float(row["distance"]) + 2 * radius, exact, delta=1e-6)
                self.check_points(row, fibers[f][s : s + 2], fibers[g][t : t + 2], radius)

    def check_points(self, row, a, b, radius):
        """A contact's points would be off its segments, or its normal in another direction."""
        normal = [float(row["normal_" + k]) for k in "xyz"]
        self.assertAlmostEqual(math.hypot(*normal), 1, delta=1e-9)
        ends = []
        for name, arc, (p, q), sign in (("a", "s", a, 1), ("b", "t", b, -1)):
            at = float(row[arc])
            self.assertTrue(0 <= at <= 1)
            axis = [x + at * (y - x) for x, y in zip(p, q)]
            surface = [x + sign * radius * n for x, n in zip(axis, normal)]
            found = [float(row[f"point_{name}_{k}"]) for k in "xyz"]
            self.assertLess(math.dist(surface, found), 1e-6)
            ends.append(found)
        along = sum((y - x) * n for x, y, n in zip(*ends, normal))
        self.assertAlmostEqual(along, float(row["distance"]), delta=1e-6)

    def test_writes_the_list_to_a_file(self):
        path = self.folder / "contacts.csv"
        self.assertEqual(
            self.run_program("check", self.fibers, "-r", 0.006, "--csv", "-o", path, code=1), ""
        )
        self.assertEqual(len(path.read_text(encoding="utf-8").splitlines()), 2)


class Lists(ProgramTest):
    """What check lists, of a ladder: each rung r crosses the rail deeper than the one before."""

    RADIUS = 0.5

    def setUp(self):
        super().setUp()
        rail = [f"{x} 0 0" for x in range(0, 45, 4)]
        self.gaps = [0.95 - 0.08 * rung for rung in range(11)]
        rungs = [f"{4 * r + 2} -1 {gap}\n{4 * r + 2} 1 {gap}" for r, gap in enumerate(self.gaps)]
        self.ladder = self.write("ladder.txt", "\n".join(rail) + "\n\n" + "\n\n".join(rungs) + "\n")

    def check(self, *arguments, code=1):
        return self.run_program("check", self.ladder, "-r", self.RADIUS, *arguments, code=code)

    def json(self, *arguments, code=1):
        return json.loads(self.check(*arguments, "--json", code=code))

    def test_deepest_first(self):
        """The contacts that matter most would be at the end, or missing."""
        rows = [line.split() for line in self.check().split("distance\n")[1].splitlines()[:10]]
        self.assertEqual([int(row[2]) for row in rows], list(range(11, 1, -1)))
        for row, gap in zip(rows, reversed(self.gaps)):
            self.assertAlmostEqual(float(row[4]), gap - 1, delta=1e-4)
        self.assertIn("and 1 more;", self.check())
        self.assertNotIn(" more;", self.check("--top", 11))
        for top in (1, 2, 11, 50):
            fibers = [c["fiber_b"] for c in self.json("--top", top)["contacts"]]
            self.assertEqual(fibers, list(range(11, 0, -1))[:top])
            fibers = [c["fiber_b"] for c in self.json("--top", top, "--sort", "fiber")["contacts"]]
            self.assertEqual(fibers, list(range(1, 12))[:top])
        self.assertEqual(self.json("--top", 2)["contact_count"], 11)

    def test_head(self):
        """What a number belongs to would be unknown."""
        head = self.json("--report", "volumes", "--volumes", "spheres")
        self.assertEqual((head["report"], head["volumes"]), ("volumes", "spheres"))
        head = self.json()
        self.assertEqual((head["report"], head["volumes"]), ("capsules", "boxes"))
        self.assertEqual(head["version"], self.run_program("--version").strip())
        self.assertEqual(head["radius"], self.RADIUS)
        self.assertGreater(head["seconds"], 0)
        self.assertIs(head["complete"], True)
        self.assertEqual((head["touching_segments"], head["touching_fibers"]), (22, 12))
        self.assertAlmostEqual(head["least_distance"], self.gaps[-1] - 1, delta=1e-9)
        self.assertIsNone(self.json_of_tapered()["radius"])

    def json_of_tapered(self):
        path = self.folder / "tapered.hair"  # thick at its root
        head = struct.pack("<4s4If", b"HAIR", 1, 3, 6, 2, 1).ljust(128, b"\0")
        path.write_bytes(head + struct.pack("<9f", *range(9)) + struct.pack("<3f", 3, 2, 1))
        return json.loads(self.run_program("check", path, "--json"))

    def test_depths_are_counted(self):
        """Deep contacts would look harmless."""
        counts = self.json()["depths"]
        for one, after in zip(counts, counts[1:]):
            self.assertEqual(one["to"], after["from"])
        self.assertEqual((counts[0]["from"], counts[-1]["to"]), (0, 1))
        for part in counts:
            inside = [g for g in self.gaps if part["from"] <= 1 - g < part["to"]]
            self.assertEqual(part["pairs"], len(inside), part)
        text = self.check("--margin", 0.001)
        self.assertRegex(text, r"\n +75 to 100 +2  #+\n")
        self.assertNotIn("apart", text)
        apart = self.run_program("check", self.ladder, "-r", 0.4, "--margin", 0.2, code=1)
        self.assertRegex(apart, r"\n +apart +2  #+\n")

    def test_summary_by_fiber_pair(self):
        """Which fibers touch would have to be found in a list of segments."""
        path = self.write(
            "comb.txt",
            "0 0 0\n1 0 0\n2 0 0\n3 0 0\n\n9 9 9\n\n0 0 .3\n3 0 .2\n\n2 -1 -.3\n2 1 -.3\n",
        )
        scene = ("check", path, "-r", 0.2, "--summary")
        found = json.loads(self.run_program(*scene, "--json", code=1))
        rows = [(r["fiber_a"], r["fiber_b"], r["contacts"]) for r in found["fiber_pairs"]]
        self.assertEqual(rows, [(0, 2, 3), (0, 3, 2)])
        self.assertNotIn("contacts", found)
        self.assertAlmostEqual(found["fiber_pairs"][1]["distance"], -0.1, delta=1e-6)
        rows = list(csv.DictReader(io.StringIO(self.run_program(*scene, "--csv", code=1))))
        self.assertEqual([(int(r["fiber_b"]), int(r["contacts"])) for r in rows], [(2, 3), (3, 2)])
        self.assertRegex(self.run_program(*scene, code=1), r"\n +0 +2 +3 +-0\.2")

    def test_too_many_pairs(self):
        """A radius that is far too large would fill the memory."""
        self.check("--limit", 11)
        self.assertEqual(self.stderr, "")
        found = self.json("--limit", 10)
        self.assertEqual((found["complete"], found["contact_count"]), (False, 10))
        for word in ("10 pairs", "incomplete", "radius is probably too large", "--limit"):
            self.assertIn(word, self.stderr)
        self.assertIn("at least 10 pairs touch", self.check("--limit", 10))
        page = self.folder / "page.html"
        self.run_program("view", self.ladder, "-r", self.RADIUS, "--limit", 10, "-o", page)
        self.assertIn("10 pairs", self.stderr)
        dense = "helix:fibers=60,segments=9,radius=9"
        self.run_program("check", dense, code=1)
        self.assertIn("more than 20 pairs for each segment", self.stderr)
        self.run_program("check", dense, "--report", "volumes", code=1)
        self.assertEqual(self.stderr, "")

    def test_pairs_along_a_yarn(self):
        """Hundreds of contacts would be those of a fiber with itself, as it goes along."""
        yarn = self.write("yarn.txt", "".join(f"{0.1 * i} 0 0\n" for i in range(40)))
        self.run_program("check", yarn, "-r", 0.5, code=1)
        advice = self.stderr.split("--ignored-arc-length ")[1].split(",")[0]
        self.assertAlmostEqual(float(advice), math.pi * 0.5, delta=1e-3)
        self.run_program("check", yarn, "-r", 0.5, "-a", advice)
        self.assertEqual(self.stderr, "")
        self.check()
        self.assertEqual(self.stderr, "")

    def test_exit_zero(self):
        self.check("--exit-zero", code=0)
        self.run_program("check", self.folder / "none", "--exit-zero", code=2)

    def test_standard_input(self):
        with open(self.ladder, encoding="utf-8") as text:
            done = subprocess.run(
                [PROGRAM, "check", "-", "-r", "0.5", "--json"],
                stdin=text,
                capture_output=True,
                check=False,
            )
        found = json.loads(done.stdout)
        self.assertEqual((found["scene"], found["contact_count"]), ("standard input", 11))

    def test_against_another_file(self):
        """Hair and what it lies on are often two files."""
        bar = self.write(
            "bar.txt", "6 -1 -0.9\n6 1 -0.9\n\n5 5 5\n5 6 5\n\n22 -1 -1.2\n22 1 -1.2\n"
        )
        arguments = ("check", self.ladder, "--against", bar)
        found = json.loads(self.run_program(*arguments, "-r", 0.5, "--json", code=1))
        keys = ("fiber_a", "segment_a", "fiber_b", "segment_b")
        self.assertEqual([tuple(c[k] for k in keys) for c in found["contacts"]], [(0, 1, 0, 0)])
        self.assertEqual(
            (found["touching_segments"], found["against"]["touching_segments"]), (1, 1)
        )
        self.assertEqual((found["against"]["fibers"], found["against"]["radius"]), (3, 0.5))
        thick = (*arguments, "-r", 0.5, "-r", 0.8, "--json")
        found = json.loads(self.run_program(*thick, code=1))
        self.assertEqual([c["fiber_b"] for c in found["contacts"]], [0, 2])
        text = self.run_program(*arguments, "-r", 0.5, code=1)
        self.assertIn("against bar.txt: 3 segments of 3 fibers\n", text)
        self.assertIn("touches: 1 segment of 1 fiber against 1 segment of 1 fiber\n", text)

    def test_files_as_frames(self):
        """Frames of a simulation would have to be checked one by one."""
        apart = self.write("apart.txt", "0 0 0\n1 0 0\n\n0 0 2\n1 0 2\n")
        near = self.write("near.txt", "0 0 0\n1 0 0\n\n0 0 .9\n1 0 .9\n")
        more = self.write("more.txt", "0 0 0\n1 0 0\n2 0 0\n\n0 0 .9\n2 0 .9\n")
        frames = ("check", apart, near, more, apart, "-r", 0.5)
        text = self.run_program(*frames, code=1)
        columns = [line.split() for line in text.splitlines()[1:]]
        self.assertEqual(
            [row[:2] for row in columns], [["0", "0"], ["1", "1"], ["2", "2"], ["3", "0"]]
        )
        self.assertEqual([row[2] for row in columns], ["-", "-0.1", "-0.1", "-"])
        self.assertEqual([row[4] for row in columns][:2], ["apart.txt", "near.txt"])
        found = json.loads(self.run_program(*frames, "--json", code=1))["frames"]
        self.assertEqual([f["contact_count"] for f in found], [0, 1, 2, 0])
        self.assertEqual([f["frame"] for f in found], [0, 1, 2, 3])
        rows = list(csv.DictReader(io.StringIO(self.run_program(*frames, "--csv", code=1))))
        self.assertEqual(list(rows[0]), ["frame", *CONTACT_COLUMNS])
        self.assertEqual([int(row["frame"]) for row in rows], [1, 2, 2])
        self.run_program("check", apart, apart, "-r", 0.5)
        picture = self.folder / "segments.vtp"
        self.run_program(*frames, "--write-segments", picture, code=2)
        self.assertIn("one frame", self.stderr)
        self.run_program(*frames, "--top", 3, code=2)
        self.assertFalse(picture.exists())

    def test_frames_of_a_generated_scene(self):
        """A tree that is refitted would find other pairs than a new one."""
        scene = "paper-dynamic:fibers=60,segments=20"
        text = self.run_program("check", scene + ",frames=60:85:25", "--json", code=1)
        for frame in json.loads(text)["frames"]:
            alone = f"{scene},frame={frame['frame']}"
            found = json.loads(self.run_program("check", alone, "--json", code=1))
            self.assertEqual(frame["contacts"], found["contacts"])
        self.assertEqual(found["contact_count"] > 5, True)
        self.assertIn("segments of 60 fibers\n", self.run_program("check", scene, code=1))


class Distance(ProgramTest):
    def nearest(self, *arguments):
        return json.loads(self.run_program("distance", *arguments, "--json"))["nearest"]

    def test_between_fibers(self):
        """A user would be told another distance, or another place."""
        path = self.write("crossing.txt", CROSSING)
        found = self.nearest(path, "-r", 0.004)
        self.assertAlmostEqual(found["distance"], 0.002, delta=1e-12)
        self.assertEqual([found[k] for k in SEGMENTS], [0, 1, 1, 0])
        self.assertLess(math.dist(found["point_a"], (1.5, 0, 0.004)), 1e-12)
        self.assertLess(math.dist(found["point_b"], (1.5, 0, 0.006)), 1e-12)
        self.assertIn(
            "the least distance is 0.002\n", self.run_program("distance", path, "-r", 0.004)
        )
        text = self.run_program("distance", path, "-r", 0.006)
        self.assertIn("the deepest overlap is 0.002\n", text)

    def test_agrees_with_brute_force(self):
        path = self.folder / "helix.txt"
        self.run_program("generate", "helix:fibers=12,segments=15", "-o", path)
        fibers = read_polylines(path)
        segments = [(f, *ends) for f, fiber in enumerate(fibers) for ends in zip(fiber, fiber[1:])]
        least = min(
            segment_distance(p, q, u, v)
            for i, (f, p, q) in enumerate(segments)
            for g, u, v in segments[i + 1 :]
            if f != g
        )
        for radius in (0, 0.001, 0.2):
            found = self.nearest(path, "-r", radius)
            self.assertAlmostEqual(found["distance"], least - 2 * radius, delta=1e-6)

    def test_radii_that_differ(self):
        """The nearest axes would pass for the nearest surfaces."""
        path = self.folder / "tapered.hair"
        head = struct.pack("<4s4If", b"HAIR", 3, 6, 6, 1, 1).ljust(128, b"\0")
        points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0), (0, -3, 0), (1, -3, 0)]
        flat = [x for point in points for x in point]
        for thick, pair, distance in ((4.7, (0, 2), 0.4), (6.5, (0, 2), -0.5), (1, (0, 1), 0.5)):
            thickness = (0.5, 0.5, 0.5, 0.5, thick, thick)
            path.write_bytes(head + struct.pack("<18f", *flat) + struct.pack("<6f", *thickness))
            found = self.nearest(path)
            self.assertEqual((found["fiber_a"], found["fiber_b"]), pair)
            self.assertAlmostEqual(found["distance"], distance, delta=1e-6)

    def test_between_two_files(self):
        one = self.write("one.txt", "0 0 0\n1 0 0\n\n0 0 .1\n1 0 .1\n")
        two = self.write("two.txt", "0 0 5\n1 0 5\n\n0 0 4\n1 0 4\n")
        found = self.nearest(one, two, "-r", 0.5)
        self.assertEqual([found[k] for k in SEGMENTS], [1, 0, 1, 0])
        self.assertAlmostEqual(found["distance"], 2.9, delta=1e-12)
        self.assertAlmostEqual(self.nearest(one, two, "-r", 0.5, "-r", 1)["distance"], 2.4)

    def test_a_fiber_that_turns_back(self):
        """Each fiber would be near to itself, as it goes along; or a knot would be far from itself."""
        straight = self.write("straight.txt", "".join(f"{0.1 * i} 0 0\n" for i in range(9)))
        self.assertIsNone(self.nearest(straight, "-r", 0.01))
        self.assertIn("no two segments", self.run_program("distance", straight, "-r", 0.01))
        hairpin = self.write("hairpin.txt", "0 0 0\n5 0 0\n6 0.5 0\n5 1 0\n0 0.9 0\n")
        found = self.nearest(hairpin, "-r", 0.1)
        self.assertEqual((found["segment_a"], found["segment_b"]), (0, 3))
        self.assertAlmostEqual(found["distance"], 0.7, delta=1e-9)
        self.assertIsNone(self.nearest(hairpin, "-r", 0.1, "-n", 3))
        self.assertIsNone(self.nearest(hairpin, "-r", 0.1, "-a", 3))


def segment_distance(p, q, u, v):
    """The least over a fine grid of one segment of the distance to the other: right to 1e-6 of
    lengths of 2, for the distance is convex along it and searched by thirds."""

    def to_other(s):
        x = [a + s * (b - a) for a, b in zip(p, q)]
        d = [b - a for a, b in zip(u, v)]
        t = sum(e * (c - a) for e, c, a in zip(d, x, u)) / sum(e * e for e in d)
        t = min(1, max(0, t))
        return math.dist(x, [a + t * e for a, e in zip(u, d)])

    low, high = 0.0, 1.0
    for _ in range(60):
        a, b = low + (high - low) / 3, high - (high - low) / 3
        if to_other(a) <= to_other(b):
            high = b
        else:
            low = a
    return to_other((low + high) / 2)


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
        self.assertEqual(data["segment"], [0, 1, 2, 0, 0])
        self.assertEqual(data["touching"], [0, 1, 0, 1, 0])
        self.assertEqual(point_data["radius"], [0.006] * 8)

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
        ):
            path = self.folder / "scene.vtp"
            self.run_program("generate", scene, "-o", path)
            texts.append(path.read_text(encoding="utf-8"))
        self.assertEqual(texts.pop(7), texts[6], "85 is the dynamic assembly's own frame")
        self.assertEqual(len(set(texts)), len(texts))


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
            "single point, which touch nothing: 1",
            "length zero, whose points coincide: 1",
            "join two fibers: 1",
            "the file holds no radius",
            "begin where another one does, which may be copies: 1",
        ):
            self.assertIn(expected, text)
        self.assertIn("shorter than wide", self.run_program("info", path, "-r", 0.6))
        far = self.write("far.txt", "1e9 0 0\n1e9 1 0\n1e9 2 0\n")
        self.assertIn("million times its size", self.run_program("info", far, "-r", 0.1))


class Bench(ProgramTest):
    def test_all_managers_find_the_same(self):
        path = self.folder / "scene.vtp"
        self.run_program("generate", "helix:fibers=20,segments=20", "-o", path)
        for scene in ((path, "-r", 0.05), ("helix:fibers=20,segments=20,radius=0.05",)):
            found = json.loads(self.run_program("bench", *scene, "--repetitions", 1, "--json"))
            managers = {row["manager"]: row for row in found["managers"]}
            self.assertIn("LayeredAABBTree, capsules", managers)
            self.assertIn("DynamicAABBTree, tight", managers)
            self.assertTrue(all(row["right"] for row in managers.values()))
            self.assertEqual(len({row["touching"] for row in managers.values()}), 1)
            exact = managers["LayeredAABBTree, capsules"]
            self.assertEqual(exact["pairs"], exact["touching"])
            self.assertTrue(all(row["update_s"] > 0 for row in managers.values()))
        for key in ("version", "compiler", "processor"):
            self.assertTrue(found[key])
        table = self.run_program("bench", path, "-r", 0.05, "--repetitions", 1)
        self.assertIn("DynamicAABBTree Array, tight", table)
        self.assertIn(": 400 segments of 20 fibers\n", table)
        self.assertRegex(table, r"^fcl_fibers \d+\.\d+\.\d+, (gcc|clang) .*, .*\n")
        self.assertNotIn("1e-9", table)

    def test_tells_of_pairs_at_the_boundary(self):
        """Pairs that just touch would be missing from a count without a word."""
        path = self.write("touching.txt", "0 0 0\n1 0 0\n\n0 0 1\n1 0 1\n\n0 5 0\n1 5 0\n")
        scene = ("bench", path, "-r", 0.5, "--repetitions", 1)
        managers = json.loads(self.run_program(*scene, "--json"))["managers"]
        self.assertEqual({(row["touching"], row["undecided"]) for row in managers}, {(0, 1)})
        self.assertIn("without 1 that", self.run_program(*scene))


class BadUse(ProgramTest):
    def refused(self, *arguments, says):
        self.assertEqual(self.run_program(*arguments, code=2), "")
        self.assertIn(says, self.stderr)
        self.assertEqual(self.files(), [])

    def test_options_that_are_none(self):
        out = self.folder / "out.vtp"
        self.refused(says="subcommand")
        self.refused("frobnicate", says="")
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
            ("bench", path),
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
                ("bench", path, "--repetitions", 1),
                ("view", path, "-o", f"{out}.html"),
                ("distance", path),
                ("convert", path, f"{out}.vtp"),
            ):
                self.run_program(*command, *radius)
                self.assertIn(f"fcl_fibers: warning: {path.name}: ", self.stderr)
                self.assertEqual(self.stderr.count(warning), 1, command)
            self.assertIn(warning, self.run_program("info", path, *radius))
            self.assertEqual(self.stderr, "")

    def test_help_reads_well(self):
        text = self.run_program("--help")
        for word in HELPED + ("paper-half-scalp", "frames=FIRST:LAST:STEP"):
            self.assertIn(word, text)
        for command in HELPED:
            text = self.run_program(command, "--help")
            self.assertIn("file" if command == "convert" else "SCENE", text)
            if command == "check":
                for column in CONTACT_COLUMNS[:7]:
                    self.assertRegex(text, rf"\b{column}\b")
            self.assertLessEqual(max(map(len, text.splitlines())), 100)
        self.assertRegex(self.run_program("--version"), r"^\d+\.\d+\.\d+\n$")


class Completion(ProgramTest):
    SCRIPT = Path(__file__).parents[2] / "tools" / "completion.bash"

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


class WholeFiles(ProgramTest):
    def test_what_was_there_stays_where_writing_fails(self):
        path = self.write("scene.vtp", "as it was")
        self.run_program("generate", "helix:fibers=0", "-o", path, code=2)
        self.assertEqual(path.read_text(encoding="utf-8"), "as it was")
        self.assertEqual(self.files(), ["scene.vtp"])

    def test_nothing_is_left_of_what_was_interrupted(self):
        """Half a file would be taken for a whole one."""
        path = self.write("page.html", "as it was")
        for number in (signal.SIGINT, signal.SIGTERM):
            process = subprocess.Popen(
                [PROGRAM, "view", "paper-half-scalp:fibers=20000", "-o", path]
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
