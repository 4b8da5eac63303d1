# SPDX-License-Identifier: BSD-3-Clause
"""The commands check and distance, as a user meets them."""

import csv
import io
import json
import math
import re
import struct
import subprocess
import unittest

from program import CONTACT_COLUMNS, CROSSING, PROGRAM, SEGMENTS, ProgramTest, read_polylines


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
        self.assertEqual(self.page_of(ring, "-r", 0.1)["frames"][0]["contacts"], 0)

    def test_volumes_and_topology_change_no_contact(self):
        """An option that is about time would be about contacts."""
        path = self.folder / "helix.txt"
        self.run_program("generate", "helix:fibers=12,segments=15", "-o", path)
        self.assertEqual([len(fiber) for fiber in read_polylines(path)], [16] * 12)
        found = self.segments(path, "-r", 0.04)
        self.assertGreater(len(found), 20)
        for options in (["--volumes", "spheres"], ["--topology", "super-thread"]):
            others = self.segments(path, "-r", 0.04, *options)
            self.assertEqual(sorted(others), sorted(found))

    def test_samples_of_a_neuron(self):
        """Nobody could find a contact in the file again, or branches would touch themselves."""
        rows = ("1 1 0 0 0 .2 -1", "2 3 10 0 0 .1 1", "7 3 20 0 0 .1 2", "5 2 10 5 0 .2 2")
        text = "\n".join((*rows, "9 2 20 .15 0 .1 5")) + "\n"
        neuron = self.write("neuron.swc", text)
        found = json.loads(self.run_program("check", neuron, "--json", code=1))["contacts"]
        self.assertEqual(len(found), 1)
        a, b = ({"sample": found[0]["sample_" + s], "type": found[0]["type_" + s]} for s in "ab")
        self.assertEqual((a, b), ({"sample": 7, "type": 3}, {"sample": 9, "type": 2}))
        self.assertEqual(self.page_of(neuron)["frames"][0]["contacts"], 1)
        csv = self.run_program("check", neuron, "--csv", code=1).splitlines()
        self.assertTrue(csv[0].endswith(",sample_a,type_a,sample_b,type_b"))
        self.assertTrue(csv[1].endswith(",7,3,9,2"))
        self.assertRegex(self.run_program("check", neuron, code=1), r"\n +\d.* 7 +3 +9 +2\n")
        # Against fibers that have none.
        other = self.write("other.txt", "15 -1 0\n15 1 0\n")
        call = ("check", neuron, "--against", other, "-r", 0.1)
        self.assertTrue(self.run_program(*call, "--csv", code=1).rstrip().endswith(",7,3,,"))
        found = json.loads(self.run_program(*call, "--json", code=1))["contacts"]
        self.assertEqual(found[0]["sample_a"], 7)
        self.assertNotIn("sample_b", found[0])

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
        text = self.run_program(*scene, "--top", 1, code=1)
        first = found["fiber_pairs"][0]
        x, y, z = (re.escape(f"{v:.4g}") for v in first["point_a"])
        numbers = rf"0 +{first['number_a']} +2 +{first['number_b']}"
        self.assertRegex(text, rf"\n +{numbers} +3 +{first['distance']:.4g} +{x} +{y} +{z}\n")

    def test_summary_agrees_with_the_contacts(self):
        """Contacts of many fibers would be counted with the wrong ones."""
        scene = ("check", "helix:fibers=30,segments=30,radius=0.02", "--json")
        expected = {}
        for contact in json.loads(self.run_program(*scene, code=1))["contacts"]:
            pair = (contact["fiber_a"], contact["fiber_b"])
            expected.setdefault(pair, []).append(contact)
        self.assertGreater(len(expected), 30)
        rows = json.loads(self.run_program(*scene, "--summary", code=1))["fiber_pairs"]
        self.assertEqual(len(rows), len(expected))
        for row in rows:
            contacts = expected[(row["fiber_a"], row["fiber_b"])]
            deepest = min(contacts, key=lambda contact: contact["distance"])
            self.assertEqual(row, {"contacts": len(contacts), **deepest})
        distances = [row["distance"] for row in rows]
        self.assertEqual(distances, sorted(distances))
        table = self.run_program("check", scene[1], "--csv", "--summary", code=1)
        for line, row in zip(csv.DictReader(io.StringIO(table)), rows, strict=True):
            for name in ("contacts", "fiber_a", "number_a", "s", "fiber_b", "number_b", "t"):
                self.assertEqual(float(line[name]), row[name])
            for name in ("point_a", "point_b", "normal"):
                self.assertEqual([float(line[f"{name}_{axis}"]) for axis in "xyz"], row[name])

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
        text = self.run_program("check", yarn, "-r", 0.5, code=1)
        self.assertEqual(self.stderr, "")
        advice = re.search("--ignored-arc-length ([^,]+), or --ignored-neighbors ([0-9]+),", text)
        self.assertAlmostEqual(float(advice[1]), math.pi * 0.5, delta=2e-3)
        for option, value in zip("an", advice.groups()):
            self.run_program("check", yarn, "-r", 0.5, "-" + option, value)
        self.run_program("check", yarn, "-r", 0.5, "-n", int(advice[2]) - 1, code=1)
        for output in ("--json", "--csv"):
            self.run_program("check", yarn, "-r", 0.5, output, code=1)
            self.assertIn("near along one fiber", self.stderr)
            self.check(output)
            self.assertEqual(self.stderr, "")
        self.assertNotIn("along", self.check())
        for output in ("--json", "--csv", "--exit-zero"):
            self.run_program("check", yarn, yarn, "-r", 0.5, output, "--exit-zero")
            self.assertEqual(self.stderr.count("frame 0: "), 1)
            self.assertEqual(self.stderr.count("near along one fiber"), 1)

    def test_pairs_along_a_yarn_are_counted_apart(self):
        """The deepest contacts and the depths would be those of each yarn with itself."""
        points = [(0.25 * i, 0.1 * (i % 2), 0) for i in range(30)]
        yarns = [[(x, y, z + 0.4 * k) for x, y, z in points] for k in range(3)]
        hairpin = [(20, 0, 0), (25, 0, 0), (26, 0.3, 0), (25, 0.6, 0), (20, 0.6, 0)]
        text = "\n".join("".join("%r %r %r\n" % p for p in yarn) for yarn in (*yarns, hairpin))
        path = self.write("yarns.txt", text)
        radius = 0.31
        found = json.loads(self.run_program("check", path, "-r", radius, "--json", code=1))
        turned = along = 0
        others = []
        for contact in found["contacts"]:
            a, b = contact["number_a"], contact["number_b"]
            fiber = (*yarns, hairpin)[contact["fiber_a"]]
            between = sum(math.dist(*ends) for ends in zip(fiber[a + 1 :], fiber[a + 2 : b + 1]))
            if contact["fiber_a"] == contact["fiber_b"] and between <= math.pi * radius:
                along += 1
            else:
                turned += contact["fiber_a"] == contact["fiber_b"]
                others.append(contact["distance"])
        self.assertGreater(turned, 0)
        self.assertGreater(along, 50)
        self.assertGreater(len(others), 50)
        self.assertEqual(found["along_count"], along)
        self.assertEqual(found["least_distance_of_others"], min(others))
        self.assertGreater(min(others), found["least_distance"])
        depths = found["depths"]
        self.assertEqual(sum(depth["along"] for depth in depths), along)
        self.assertEqual(sum(depth["pairs"] for depth in depths), len(found["contacts"]))
        for depth in depths:
            inside = [d for d in others if depth["from"] <= -d / (2 * radius) < depth["to"]]
            self.assertEqual(depth["pairs"] - depth["along"], len(inside))
        text = self.run_program("check", path, "-r", radius, "--top", len(others) + 2, code=1)
        rows = re.findall(r"^ +\d+ +\d+ +\d+ +\d+ +(\S+)(  along)?$", text, re.M)
        self.assertEqual([bool(row[1]) for row in rows], len(others) * [False] + 2 * [True])
        self.assertEqual(float(rows[0][0]), float(f"{min(others):.4g}"))
        self.assertIn(f"\n{along} of the pairs are near along one fiber", text)
        self.assertRegex(text, rf"\n +along +{along}  #+\n")
        text = self.run_program("check", path, "-r", radius, "--summary", "--top", 99, code=1)
        rows = re.findall(r"^ +(\d+) +\d+ +(\d+) +\d+ +\d+(?: +\S+){4}(  along)?$", text, re.M)
        apart = [row[0] != row[1] or row[0] == "3" for row in rows]
        self.assertEqual([row[2] == "" for row in rows], apart)
        self.assertIn(False, apart)
        self.assertIn(True, apart)

    def test_pairs_along_a_yarn_that_do_not_touch(self):
        """A margin reports them, and the list of depths would have them twice."""
        yarns = "\n".join("".join(f"{1.2 * i} {y} 0\n" for i in range(6)) for y in (0, 0.9))
        scene = (self.write("yarns.txt", yarns), "-r", 0.5, "-m", 0.3)
        found = json.loads(self.run_program("check", *scene, "--json", code=1))
        others = found["contact_count"] - found["along_count"]
        self.assertGreater(min(found["along_count"], others), 0)
        text = self.run_program("check", *scene, code=1)
        rows = re.findall(r"^ +(apart|along|\d+ to \d+) +(\d+)(?:  #+)?$", text, re.M)
        counts = {name: int(count) for name, count in rows if count != "0"}
        self.assertEqual(counts, {"5 to 10": others, "along": found["along_count"]})

    def test_advice_on_segments_of_length_zero(self):
        """A length of 0 would leave out nothing."""
        text = "0 0 0\n1 0 0\n1 0 0\n2 0 0\n"
        for radius, further in ((0, ""), (0.5, "--ignored-arc-length 1.572, or ")):
            scene = (self.write("steps.txt", text), "-r", radius)
            advice = f"near along one fiber, which is thick beside its segments; {further}--ign"
            self.assertIn(advice, self.run_program("check", *scene, code=1))
            self.run_program("check", *scene, "-n", 2)

    def test_advice_that_leaves_out_a_contact(self):
        """The length for a thick soma would hide where a thin branch turns back."""
        places = [
            (0, 0),
            *((i, 0) for i in range(1, 20)),
            (20, 0),
            (20.3, 0.07),
            (20, 0.15),
            (19, 0.15),
        ]
        samples = [
            f"{i + 1} {1 if i == 0 else 3} {x} {y} 0 {5 if i == 0 else 0.1} {i or -1}\n"
            for i, (x, y) in enumerate(places)
        ]
        soma = self.write("soma.swc", "".join(samples))
        text = self.run_program("check", soma, code=1)
        advice = re.search(
            r"--ignored-arc-length (\S+) \(and (\d+) others\), "
            r"or --ignored-neighbors (\d+) \(and (\d+) others\), leaves them out",
            text,
        )
        others = json.loads(self.run_program("check", soma, "--json", code=1))
        others = others["contact_count"] - others["along_count"]
        for option, value, hidden in (("-a", *advice.groups()[:2]), ("-n", *advice.groups()[2:])):
            found = self.run_program("check", soma, option, value, "--json", "--exit-zero")
            self.assertEqual(json.loads(found)["contact_count"], others - int(hidden))

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
        keys = ("fiber_a", "number_a", "fiber_b", "number_b")
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
        """Each fiber would be near to itself as it goes along, or a knot far from itself."""
        straight = self.write("straight.txt", "".join(f"{0.1 * i} 0 0\n" for i in range(9)))
        self.assertIsNone(self.nearest(straight, "-r", 0.01))
        self.assertIn("no two segments", self.run_program("distance", straight, "-r", 0.01))
        hairpin = self.write("hairpin.txt", "0 0 0\n5 0 0\n6 0.5 0\n5 1 0\n0 0.9 0\n")
        found = self.nearest(hairpin, "-r", 0.1)
        self.assertEqual((found["number_a"], found["number_b"]), (0, 3))
        self.assertAlmostEqual(found["distance"], 0.7, delta=1e-9)
        self.assertIsNone(self.nearest(hairpin, "-r", 0.1, "-n", 3))
        self.assertIsNone(self.nearest(hairpin, "-r", 0.1, "-a", 3))


if __name__ == "__main__":
    unittest.main()
