# SPDX-License-Identifier: BSD-3-Clause
"""The command `trade`, run as a user does."""

import json
import os
import signal
import subprocess
import time
import unittest
import xml.etree.ElementTree as ElementTree

from program import CROSSING, PROGRAM, ProgramTest, box

SCENE = "helix:fibers=40,segments=30,radius=0.02"


class Trade(ProgramTest):
    def setUp(self):
        super().setUp()
        cache = self.folder / "cache"
        os.environ["XDG_CACHE_HOME"] = str(cache)
        self.cache = cache / "fcl_fibers"

    def rows(self, *arguments):
        answer = json.loads(self.run_program("trade", *arguments, "--json"))
        return answer, {f"{row['dial']}: {row['value']}": row for row in answer["rows"]}

    def test_the_default_misses_nothing_and_adds_nothing(self):
        """If this failed, nothing could be compared with it."""
        answer, rows = self.rows(SCENE)
        usual = rows["tree: boxes, capsules"]
        self.assertGreater(answer["contacts"], 50)
        self.assertEqual(usual["contacts"], answer["contacts"])
        self.assertEqual((usual["missed_share"], usual["missed_share_at_most"]), (0, 0))
        self.assertEqual((usual["missed"], usual["false"]), (0, 0))
        self.assertGreater(usual["seconds"], 0)
        self.assertLess(usual["depth_error"]["worst"], 1e-12)
        self.assertGreater(rows["tree: boxes, volumes"]["false"], 0)
        self.assertGreater(rows["tree: spheres, volumes"]["false"], 0)
        managers = [row for name, row in rows.items() if name.startswith(("manager", "FCL's tree"))]
        self.assertEqual(len(managers), 7)
        for row in managers:
            if "GJK" not in row["value"]:
                self.assertEqual((row["missed"], row["false"]), (0, 0), row["value"])
        self.assertEqual(answer["chosen"]["missed"], 0)
        self.assertIn("FiberTreeOptions options;", answer["chosen"]["cpp"])

    def test_text_names_the_fastest_that_is_allowed(self):
        """If this failed, a user would get options that miss more than he allows."""
        text = self.run_program("trade", SCENE)
        self.assertIn("1,200 segments of 40 fibers", text)
        self.assertIn("all pairs were judged by their distances", text)
        self.assertIn("The fastest, missing nothing, without false pairs: ", text)
        self.assertIn("  C++     FiberTreeOptions options;", text)
        self.assertIn("  Python  tree = fcl_fibers.FiberTree(", text)
        text = self.run_program("trade", SCENE, "--budget", "0.001us")
        self.assertIn("No setting is missing nothing, without false pairs, within ", text)
        text = self.run_program("trade", SCENE, "--miss", "100%", "--false=1", "--budget=9s")
        self.assertIn("missing at most 100 %, with at most 100 % false pairs, within 9 s:", text)

    def test_meshes(self):
        """If this failed, dials of meshes would be others than those that are listed."""
        scene = self.write("scene.txt", CROSSING)
        mesh = self.write("box.obj", box((0.5, -0.5, 0.05), (2.5, 0.5, 1)))
        answer, rows = self.rows(scene, "--radius=0.1", "--mesh", mesh)
        self.assertEqual(answer["question"], "segments that touch the mesh")
        self.assertEqual(answer["contacts"], 4)
        self.assertEqual(rows["tree: boxes"]["missed"], 0)
        dials = {row["dial"] for row in answer["rows"]}
        self.assertEqual(dials, {"tree", "threads", "input", "margin", "roots", "mesh"})

    def test_tapers_and_branches(self):
        """A neuron would be judged as capsules, or as touching where it branches."""
        # A cone from 1 to 0.2 along x, which starts where another fiber does. One line meets its
        # thick end, but not a capsule of its mean radius. The other misses its thin end, but not a
        # capsule.
        samples = [(0, 0, 0, 1, -1), (10, 0, 0, 0.2, 1), (-10, 0, 0, 1, 1)]
        for x, z in ((1, 0.95), (9, 0.5)):
            count = len(samples)
            samples += [(x, -5, z, 0.1, -1), (x, 5, z, 0.1, count + 1)]
        lines = [
            f"{i + 1} 3 {x} {y} {z} {radius} {before}\n"
            for i, (x, y, z, radius, before) in enumerate(samples)
        ]
        _, rows = self.rows(self.write("neuron.swc", "".join(lines)))
        for name, expected in {
            "tree: boxes, capsules": (1, 0, 0),
            "tapers: left out, larger radii": (1, 0, 1),
            "tapers: left out, mean radii": (1, 1, 1),
            "branches: left out": (1, 0, 1),
            "manager: layered boxes": (1, 0, 1),
            "FCL's tree: tight boxes, closed form": (1, 0, 1),
        }.items():
            counts = tuple(rows[name][key] for key in ("contacts", "missed", "false"))
            self.assertEqual(counts, expected, name)
        self.assertIn("kPerFirstPoint", rows["tapers: left out, mean radii"]["cpp"])
        self.assertIn("starts_at", rows["branches: left out"]["cpp"])

    def test_a_step(self):
        """If this failed, what passes between two frames would count as found."""
        start = self.write("start.txt", CROSSING)
        end = self.write("end.txt", CROSSING.replace("0.01", "-1"))
        start.write_text(CROSSING.replace("0.01", "1"))
        answer, rows = self.rows(start, "--end", end, "--radius=0.02")
        self.assertEqual(answer["question"], "pairs that touch during the step")
        self.assertEqual(answer["contacts"], 1)
        self.assertEqual(rows["step: linear bounds"]["missed"], 0)
        self.assertEqual(rows["step: the end alone"]["missed"], 1)
        chosen = rows[f"{answer['chosen']['dial']}: {answer['chosen']['value']}"]
        self.assertEqual((chosen["missed"], chosen["false"]), (0, 0))
        dials = {row["dial"] for row in answer["rows"]}
        self.assertEqual(dials, {"step", "threads", "input", "margin", "neighbours"})

    def test_a_run_that_was_stopped_is_gone_on_with(self):
        """If this failed, a long run would begin anew, or answers of another scene would count."""
        command = [PROGRAM, "trade", SCENE, "--longest=30s"]
        with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as run:
            while not list(self.cache.glob("trade-*.json")) and run.poll() is None:
                time.sleep(0.01)
            run.send_signal(signal.SIGINT)
        (notes,) = self.cache.glob("trade-*.json")
        known = json.loads(notes.read_text())
        self.assertIn("tree: boxes, capsules", known)
        known["tree: boxes, capsules"]["bytes"] = 1200 * 12345
        notes.write_text(json.dumps(known))
        other = self.run_program("trade", SCENE + ",seed=2", "--longest=30s")
        self.assertNotIn("12345", other)
        text = self.run_program(*command[1:])
        self.assertIn("goes on with a run that was stopped", self.stderr)
        self.assertIn("12345", text)
        self.assertFalse(notes.exists())
        # What is no notes counts as nothing, and --again takes none.
        for content, flags in (("{", ()), ('{"a": 1}', ()), (json.dumps(known), ("--again",))):
            notes.write_text(content)
            self.assertNotIn("12345", self.run_program(*command[1:], *flags))

    def test_the_picture_is_svg(self):
        """If this failed, the front could not be looked at."""
        path = self.folder / "front.svg"
        self.run_program("trade", SCENE, "--picture", path)
        root = ElementTree.parse(path).getroot()
        self.assertEqual(root.tag, "{http://www.w3.org/2000/svg}svg")
        circles = [e for e in root.iter() if e.tag.endswith("circle")]
        self.assertGreater(len(circles), 40)  # two diagrams
        for circle in circles:
            self.assertGreaterEqual(float(circle.get("cy")), 60)
            self.assertLessEqual(float(circle.get("cy")), 340)

    def test_what_cannot_be_traded_is_refused(self):
        """If this failed, a scene without contacts would be said to lose none."""
        scene = self.write("scene.txt", CROSSING)
        mesh = self.write("box.obj", box((0, 0, 0), (1, 1, 1)))
        far = self.write("far.obj", box((100, 100, 100), (101, 101, 101)))
        for arguments, problem in (
            ((scene, "--radius=0.001"), "info` tells at which radius contact begins"),
            ((scene, "--radius=0.001", "--end", scene), "or a longer step"),
            ((scene, "--radius=0.001", "--mesh", far), "or a mesh in the frame and the unit"),
            ((scene,), "no radius"),
            ((scene, "--radius=1", "--miss=x"), "'x' is no SHARE such as 0.1%"),
            ((scene, "--radius=1", "--miss=5"), "'5' is no SHARE such as 0.1%"),
            ((scene, "--radius=1", "--budget=5m"), "'5m' is no TIME such as 5ms"),
            ((scene, "--radius=1", "--end", scene, "--mesh", mesh), "leave out --mesh"),
        ):
            self.run_program("trade", *arguments, code=2)
            self.assertIn(problem, self.stderr)


if __name__ == "__main__":
    unittest.main()
