# SPDX-License-Identifier: BSD-3-Clause
"""The option --end of check and view: what touches during a step, as a user meets it."""

import base64
import csv
import io
import json
import struct
import unittest

from program import CONTACT_COLUMNS, ProgramTest

IMPACT_COLUMNS = [*CONTACT_COLUMNS[:6], "time", *CONTACT_COLUMNS[6:]]

# Fiber 1 falls from 1 above fiber 0 to 1 below it; it is level. Fiber 2 touches fiber 3 all along.
START = """0 0 0
1 0 0
2 0 0

0.5 -1 1
0.5 1 1

0 0 50
1 0 50

0 0 50.1
1 0 50.1
"""
END = START.replace("0.5 -1 1\n0.5 1 1", "0.5 -1 -1\n0.5 1 -1")
NEURON = """1 1 0 0 0 1 -1
2 3 1 0 0 .5 1
3 3 4 0 0 .4 2
4 3 4 3 0 .3 3
5 3 6 -3 0 .2 3
"""


class Step(ProgramTest):
    def setUp(self):
        super().setUp()
        self.start, self.end = self.write("start.txt", START), self.write("end.txt", END)
        self.step = (self.start, "--end", self.end)

    def test_tells_when_two_fibers_meet(self):
        """A pair that passes would be missed, or its time or place be wrong."""
        self.assertIn("1 pair touches", self.run_program("check", self.end, "-r", 0.1, code=1))
        text = self.run_program("check", *self.step, "-r", 0.1, "--csv", code=1)
        rows = list(csv.DictReader(io.StringIO(text)))
        self.assertEqual(list(rows[0]), IMPACT_COLUMNS)
        self.assertEqual(
            [(row["fiber_a"], row["fiber_b"]) for row in rows], [("2", "3"), ("0", "1")]
        )
        self.assertEqual(float(rows[0]["time"]), 0)
        # They touch at a height of 0.2, of which 1 is the start and -1 the end.
        found = {name: float(value) for name, value in rows[1].items()}
        self.assertAlmostEqual(found["time"], 0.4, delta=1e-6)
        self.assertAlmostEqual(found["distance"], 0, delta=1e-6)
        self.assertAlmostEqual(found["s"], 0.5, delta=1e-6)
        self.assertAlmostEqual(found["point_a_z"], 0.1, delta=1e-6)
        self.assertAlmostEqual(found["point_b_z"], 0.1, delta=1e-6)
        for axis, expected in (("normal_x", 0), ("normal_y", 0), ("normal_z", 1)):
            self.assertAlmostEqual(found[axis], expected, delta=1e-12)

    def test_the_safe_step_ends_at_the_first_new_touch(self):
        """A program would go too far, or stay where it is for a pair that rests."""
        text = self.run_program("check", *self.step, "-r", 0.1, "--json", code=1)
        found = json.loads(text)
        self.assertEqual((found["impact_count"], found["touching_at_start"]), (2, 1))
        self.assertAlmostEqual(found["safe_step"], 0.4, delta=1e-6)
        self.assertAlmostEqual(found["mean_motion"], 2 * 2 / 9, delta=1e-12)
        self.assertEqual(found["largest_motion"], 2)
        self.assertEqual([item["time"] for item in found["impacts"]][0], 0)
        apart = self.run_program("check", *self.step, "-r", 0.01, "--json", "--exit-zero")
        self.assertAlmostEqual(json.loads(apart)["safe_step"], 0.49, delta=1e-6)
        still = self.run_program("check", self.start, "--end", self.start, "-r", 0.01, "--json")
        self.assertEqual(json.loads(still)["safe_step"], 1)

    def test_text_lists_the_first(self):
        text = self.run_program("check", *self.step, "-r", 0.1, "--top", 1, code=1)
        self.assertIn("5 segments of 4 fibers\n", text)
        self.assertIn("2 pairs touch during the step, 1 of them at its start\n", text)
        self.assertIn("and 1 more; --top N lists more", text)
        by_fiber = self.run_program("check", *self.step, "-r", 0.1, "--sort", "fiber", code=1)
        rows = [line.split() for line in by_fiber.splitlines()[-2:]]
        self.assertEqual([row[:4] for row in rows], [["0", "0", "1", "0"], ["2", "0", "3", "0"]])

    def test_generated_scenes_are_steps(self):
        """Who has no files could not try it."""
        cap = "cap:fibers=60,segments=20,radius=0.02"
        found = json.loads(
            self.run_program("check", cap, "--end", cap + ",frame=5", "--json", code=1)
        )
        times = [item["time"] for item in found["impacts"]]
        self.assertEqual(times, sorted(times))
        self.assertGreater(found["impact_count"], found["touching_at_start"])

    def test_a_limit_keeps_the_first(self):
        """A user would see some impacts and take them for the first ones."""
        cap = "cap:fibers=60,segments=20,radius=0.02"
        step = ("check", cap, "--end", cap + ",frame=5", "--json")
        all_found = json.loads(self.run_program(*step, code=1))
        self.assertTrue(all_found["complete"])
        self.assertNotIn("warning", self.stderr)
        most = all_found["touching_at_start"] + 7
        found = json.loads(self.run_program(*step, "--limit", most, code=1))
        self.assertIn(f"the first {most} are kept", self.stderr.replace(",", ""))
        self.assertEqual(found["impacts"], all_found["impacts"][:most])
        for key in ("impact_count", "touching_at_start", "safe_step"):
            self.assertEqual(found[key], all_found[key])
        self.assertFalse(found["complete"])
        text = self.run_program("check", *self.step, "-r", 0.1, "--limit", 1, code=1)
        self.assertIn("2 pairs touch during the step, 1 of them at its start", text)

    def test_refuses_what_is_no_step(self):
        """Fibers would be mixed up, or an option would be ignored."""
        fewer = self.write("fewer.txt", "0 0 0\n1 0 0\n")
        self.run_program("check", self.start, "--end", fewer, "-r", 0.1, code=2)
        self.assertIn("both need the same fibers", self.stderr)
        self.run_program("check", self.start, self.end, "--end", self.end, "-r", 0.1, code=2)
        self.assertIn("--end takes one scene", self.stderr)
        cap = "cap:fibers=9,frames=0:2"
        self.run_program("check", cap, "--end", "cap:fibers=9", code=2)
        self.assertIn("has several frames", self.stderr)
        for option in (["--report", "volumes"], ["--volumes", "spheres"]):
            self.run_program("check", *self.step, "-r", 0.1, *option, code=2)
            self.assertIn("give it without --report volumes and --volumes spheres", self.stderr)
        for option in (["--against", self.end], ["--mesh", "a.obj"], ["--summary"]):
            self.run_program("check", *self.step, "-r", 0.1, *option, code=2)
            self.assertIn("leave out --against, --mesh", self.stderr)
        page = self.folder / "page.html"
        self.run_program("view", self.start, *self.step, "-r", 0.1, "-o", page, code=2)
        self.assertIn("--end takes one scene", self.stderr)
        self.run_program("view", *self.step, "-r", 0.1, "--mesh", "a.obj", "-o", page, code=2)
        self.assertIn("leave out --mesh", self.stderr)
        self.assertFalse(page.exists())

    def test_a_file_without_branches_takes_those_of_the_other_one(self):
        """Text could be no end of a neuron's step, or its fibers would touch where they branch."""
        neuron = self.write("neuron.swc", NEURON)
        text, vtp = self.folder / "neuron.txt", self.folder / "neuron.vtp"
        for path in (text, vtp):
            self.run_program("convert", neuron, path)
        for step in ((neuron, vtp), (text, neuron), (neuron, text)):
            found = self.run_program("check", step[0], "--end", step[1], "-r", 0.1, "--json")
            self.assertEqual(json.loads(found)["impact_count"], 0)
        found = self.run_program("check", text, "--end", text, "-r", 0.1, "--json", code=1)
        self.assertEqual(json.loads(found)["impact_count"], 3)
        # Two fibers start at the end of the first one, or at its start.
        at_start = NEURON.replace(" .3 3", " .3 1").replace(" .2 3", " .2 1")
        other = self.write("other.swc", at_start)
        lines = text.read_text().splitlines()
        self.assertEqual(lines[4], "4 0 0")
        apart = self.write("apart.txt", "\n".join([*lines[:4], "4 0 0.5", *lines[5:]]) + "\n")
        for step in ((neuron, apart), (apart, neuron)):
            self.run_program("check", step[0], "--end", step[1], "-r", 0.1, code=2)
            self.assertRegex(
                self.stderr,
                "in .apart.txt. fiber . starts at another place than point ., at which it "
                "branches; give both the same coordinates",
            )
        self.run_program("check", other, "--end", neuron, "-r", 0.1, code=2)
        self.assertIn(
            "in 'other.swc' and 'neuron.swc' fibers do not branch at the same points;", self.stderr
        )

    def test_impacts_tell_samples(self):
        """Nobody could find an impact in the file of the neuron again."""
        start = self.write("start.swc", NEURON + "9 1 2 5 0 .3 -1\n8 2 2 5 1 .3 9\n")
        end = self.write("end.swc", NEURON + "9 1 2 0 .7 .3 -1\n8 2 2 0 1.7 .3 9\n")
        text = self.folder / "start.txt"
        self.run_program("convert", start, text)
        impact = json.loads(self.run_program("check", start, "--end", end, "--json", code=1))
        names = ("sample_a", "type_a", "sample_b", "type_b")
        self.assertEqual([impact["impacts"][0][name] for name in names], [3, 3, 8, 2])
        for step in ((start, "--end", end), (text, "-r", 0.4, "--end", end)):
            head, row = self.run_program("check", *step, "--csv", code=1).splitlines()[:2]
            self.assertTrue(head.endswith(",normal_z,sample_a,type_a,sample_b,type_b"))
            self.assertTrue(row.endswith(",3,3,8,2"))
            table = self.run_program("check", *step, code=1)
            self.assertRegex(table, r"time +sample +type +sample +type\n.* 3 +3 +8 +2\n")

    def test_a_page_has_each_impact_at_its_time(self):
        """The page would show a contact too early, too late, twice or not at all."""
        scene = self.page_of(*self.step, "-r", 0.1)
        self.assertEqual(scene["impacts"], 2)
        frames = scene["frames"]
        self.assertEqual(
            [frame["label"] for frame in frames[::16]], ["time 0.000", "time 0.500", "time 1.000"]
        )
        found = {i: frame["contacts"] for i, frame in enumerate(frames) if frame["contacts"] > 0}
        self.assertEqual(found, {0: 1, 13: 1})  # 0.4 is between 12 / 32 and 13 / 32
        self.assertFalse(any(frame["stopped"] for frame in frames))

    def test_a_page_tells_where_impacts_are_missing(self):
        """A frame would look as if nothing touched."""
        cap = "cap:fibers=60,segments=20,radius=0.0003"
        step = (cap, "--end", cap + ",frame=5")
        everything = self.page_of(*step)["frames"]
        most = sum(frame["contacts"] for frame in everything[:20]) + 1
        scene = self.page_of(*step, "--limit", most)
        self.assertEqual(scene["impacts"], sum(frame["contacts"] for frame in everything))
        self.assertIn("are kept", self.stderr)
        for frame, complete in zip(scene["frames"][:20], everything):
            self.assertEqual(frame["contacts"], complete["contacts"])
            self.assertFalse(frame["stopped"])
        self.assertGreater(sum(frame["contacts"] for frame in everything[20:]), 1)
        self.assertTrue(scene["frames"][-1]["stopped"])

    def test_radii_change_in_a_page(self):
        """Boxes of the tree would not be around the fibers."""
        helix = "helix:fibers=5,segments=9,radius=%g"
        thin, both = (self.page_of(helix % 0.1, "--end", helix % r) for r in (0.1, 0.9))
        self.assertEqual(both["frames"][0], thin["frames"][0])
        for i in (8, 16, 32):
            width, thin_width = (
                struct.unpack("<6f", base64.b64decode(page["frames"][i]["volumes"]["boxes"][0]))[3]
                for page in (both, thin)
            )
            self.assertAlmostEqual(width - thin_width, 0.8 * i / 32, delta=1e-4)


if __name__ == "__main__":
    unittest.main()
