# SPDX-License-Identifier: BSD-3-Clause
"""Each report of benchmarks/report is made from small recorded results; see record.py."""

import contextlib
import csv
import io
import itertools
import json
import math
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np
import pandas as pd

HERE = Path(__file__).resolve().parent
BENCHMARKS = HERE.parent.parent / "benchmarks"
sys.path.insert(0, str(BENCHMARKS / "report"))

import figures  # noqa: E402
import report  # noqa: E402
from ratios import Ratio, median_of, ratio_of  # noqa: E402
from sets import SETS  # noqa: E402


class ReportTest(unittest.TestCase):
    def setUp(self):
        self.root = Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.root)
        self.folder = self.root / "results"

    def take(self, kind, *names):
        """Copies recorded results, all of the kind if none are named."""
        self.folder.mkdir(exist_ok=True)
        for path in (HERE / "results" / kind).iterdir():
            if not names or path.stem in names:
                shutil.copy(path, self.folder)

    def made(self, kind, *flags):
        """What the report prints."""
        with contextlib.redirect_stdout(io.StringIO()) as text:
            report.main([kind, str(self.folder), *map(str, flags)])
        return text.getvalue()

    def assert_fails(self, message, kind="headline", *flags):
        with self.assertRaisesRegex(Exception, message):
            self.made(kind, *flags)

    def edit(self, name, change, **context):
        """Changes the runs of a file, each a dictionary, and its context."""
        path = self.folder / f"{name}.json"
        document = json.loads(path.read_text())
        document["context"].update(context)
        document["benchmarks"] = [run for run in document["benchmarks"] if change(run) is not False]
        path.write_text(json.dumps(document))

    def put(self, name, values):
        """The runs of a file whose names begin so get such values, those of a list by turns."""
        turns = {
            start: {key: itertools.cycle(np.atleast_1d(all_).tolist()) for key, all_ in of.items()}
            for start, of in values.items()
        }

        def change(run):
            for start, of in turns.items():
                if run["run_name"].startswith(start):
                    run.update({key: next(turn) for key, turn in of.items()})

        self.edit(name, change)

    def set_times(self, contender, **values):
        """The same of the frames of a contender in frames_helix."""
        floats = {key: np.array(all_, float) for key, all_ in values.items()}
        self.put("frames_helix", {f"Frames/{contender}/iterations": floats})

    def row(self, text, name):
        """The cells of the only row of that name."""
        lines = [line for line in text.splitlines() if line.startswith(f"| {name}")]
        self.assertEqual(len(lines), 1, f"{name}: {lines}")
        return [cell.strip() for cell in lines[0].strip("|").split("|")][1:]

    def fcl(self, boxes, key="detection"):
        """Names of FCL's contenders that have that counter."""
        runs = json.loads((self.folder / "frames_helix.json").read_text())["benchmarks"]
        names = ["/".join(run["run_name"].split("/")[:3]) for run in runs if run.get(key, 0) > 0]
        start = "Frames/Dynamic"
        return sorted({n[7:] for n in names if n.startswith(start) and f"/{boxes}" in n})

    def test_a_ratio_of_the_first_table_is_the_median_of_turns(self):
        """If this failed, the first table would state other ratios than were measured."""
        self.take("full", "frames_helix")
        for name in [n for n in self.fcl("tight") if "_and_" not in n]:
            self.set_times(name, detection=9)
        best = [n for n in self.fcl("tight") if "_and_" not in n][0]
        end = [1, 2, 3, 4, 5]
        # The medians alone are as 4.5 to 1.5.
        self.set_times("LayeredAABBTree/boxes", detection=[1.5, 1.5, 1.5, 0.9, 1.4], end=end)
        self.set_times(best, detection=[6, 6, 4.5, 3.6, 4.2], end=end)
        found = self.row(self.made("headline"), "Detection: FCL, tight boxes")
        self.assertRegex(found[0], r"^4\.0x \(3\.0 to 4\.0\)$")

    def test_an_interval_holds_the_true_ratio_as_often_as_it_promises(self):
        """If this failed, noise would be sold as an advantage."""
        random = np.random.default_rng(5)
        tries, held = 400, 0
        for _ in range(tries):
            theirs, ours = (pd.Series(m * random.lognormal(0, 0.1, 15)) for m in (3.0, 1.5))
            ratio = ratio_of(theirs, ours)
            held += ratio.low <= 2 <= ratio.high
        # The bootstrap of a median of 15 holds it in some 93 % instead of 95 %; 3 sigma are 4 %.
        self.assertGreater(held, 0.89 * tries)
        self.assertLess(held, tries)

    def test_a_ratio_is_of_runs_that_ended_next_to_each_other(self):
        """If this failed, a machine that is slow for minutes would make every ratio uncertain, or
        one that was slow during the runs of one of two would make the other faster."""
        random = np.random.default_rng(6)

        def runs(count, median):
            ends = np.sort(random.uniform(0, 200, count))
            slow = 1 + 0.5 * (ends // 40 % 2)  # for 40 seconds, then fast again
            return pd.Series(median * slow * random.lognormal(0, 0.01, count), ends)

        for theirs, ours in ((runs(9, 3.0), runs(75, 1.5)), (runs(75, 3.0), runs(9, 1.5))):
            ratio = ratio_of(theirs, ours)
            # A single ratio is off by 1.4 %, a median of nine by 0.6 %; 3 sigma are 2 %.
            self.assertLess(abs(ratio.value - 2), 0.04)
            self.assertLess(ratio.high, 1.05 * ratio.low)
            self.assertLessEqual(ratio.low, ratio.value)
        theirs, ours = pd.Series([6.0, 4.0], [9, 1]), pd.Series([2.0, 1.0, 3.0], [0, 10, 5])
        self.assertEqual(ratio_of(theirs, ours).value, (6 / 1 + 4 / 2) / 2)

    def test_an_interval_holds_over_processes(self):
        """If this failed, the luck of one process would be sold as an advantage, or all processes
        would compare with the tree that was fastest in one of them."""
        self.take("full", "frames_helix")
        managers = self.fcl("", "update")
        first, second = (next(n for n in managers if of in n) for of in ("/tight", "/stock"))
        self.set_times("LayeredAABBTree/boxes", update=1)
        texts = {}
        for file, best, update in (
            ("frames_helix.json", first, 2.0),
            ("frames_helix.2.json", second, 2.6),
            ("frames_helix.3.json", first, 2.4),
        ):
            for name in managers:
                self.set_times(name, update=update if name == best else 9)
            texts[file] = (self.folder / "frames_helix.json").read_text()
        for file, text in texts.items():
            (self.folder / file).write_text(text)
        self.edit("frames_helix.2", lambda run: True, commit="other")
        text = self.made("headline")
        found = self.row(text, "Update: FCL")
        self.assertEqual(found, ["2.4x (2.0 to 2.6), tight or stock"])
        self.assertIn("Each scene was measured in 3 processes", text)
        self.assertRegex(text, "commit [0-9a-f-]* and other")
        (self.folder / "frames_helix.10.json").write_text(texts["frames_helix.json"])
        self.assert_fails("frames_helix.10.json: this set has no measure of this name")

    def test_a_ratio_says_no_more_than_its_interval(self):
        """If this failed, noise would be sold as an advantage, or an advantage as noise."""
        for ratio, text in (
            (Ratio(3, 2.5, 3.5), "3.0x (2.5 to 3.5)"),
            (Ratio(3, 2, 3.1), "too noisy to tell (2.0 to 3.1)"),
            (Ratio(1.05, 0.9, 1.1), "as fast (0.900 to 1.10)"),
            (Ratio(1.05, 0.896, 1.1), "1.05x (0.896 to 1.10)"),
            (Ratio(1.05, 0.9, 1.13), "1.05x (0.900 to 1.13)"),
            (Ratio(0.8, 0.7, 1.0), "0.80x (0.70 to 1.0)"),
            (Ratio(3, 2.9, 3.1, runs=3), "about 3.0x, 3 runs"),
            (ratio_of(pd.Series([6.0]), pd.Series(5 * [2.0])), "about 3.0x, 1 run"),
            (median_of(pd.Series(5 * [2.0])), "2.0x (2.0 to 2.0)"),
        ):
            self.assertEqual(ratio.text(), text)

    def test_best_is_whose_median_is_least_whatever_a_single_run_says(self):
        """If this failed, a peer would be represented by a configuration that is not its best."""
        self.take("full", "frames_helix")
        for name in self.fcl("", "set_up"):
            self.set_times(name, set_up=[1, 8, 8, 8, 8])
        best = [name for name in self.fcl("stock", "set_up")][0]
        self.set_times(best, set_up=6)
        self.set_times("LayeredAABBTree/boxes", set_up=2)
        table = self.made("full").split("## The fastest")[0]
        found = self.row(table, "Set-up: FCL, boxes written before")
        self.assertEqual(found, ["3.0x (3.0 to 3.0), stock"])

    def test_set_up_is_told_without_the_boxes_and_with_them(self):
        """If this failed, FCL's set-up would look shorter than what a program has to do."""
        self.take("full", "frames_helix")
        for name in self.fcl("", "set_up"):
            self.set_times(name, set_up=4, boxes=6 if "/stock" in name else 2)
        self.set_times("LayeredAABBTree/boxes", set_up=2)
        text = self.made("full")
        table = text.split("## The fastest")[0]
        found = self.row(table, "Set-up: FCL, boxes written before")
        self.assertRegex(found[0], r"^2.0x \(2.0 to 2.0\)")
        found = self.row(table, "Set-up: FCL, with its boxes")
        self.assertEqual(found, ["3.0x (3.0 to 3.0), tight"])
        scene = text.split("## helix")[1]
        self.assertEqual(self.row(scene, "LayeredAABBTree, boxes  ")[:2], ["2.00 s", "2.00 s"])
        names = [name for name in self.fcl("stock") if "_and_" not in name]
        found = self.row(scene, names[0].replace("/", ", ").replace("_", " ") + "  ")
        self.assertEqual(found[:2], ["4.00 s", "10.0 s"])

    def test_touching_pairs_say_how_large_their_sample_was(self):
        """If this failed, an estimate would stand as a measurement."""
        self.take("full", "frames_helix")
        for boxes, factor in (("tight", 10), ("stock", 20)):
            for name in [n for n in self.fcl(boxes) if n.endswith("_and_collide")]:
                self.set_times(name, detection=factor, update=0, of=70000, sampled=50500)
        for name in [n for n in self.fcl("tight") if n.endswith("_and_test")]:
            self.set_times(name, detection=7.5, update=0)
        self.set_times("LayeredAABBTree/capsules", detection=3, update=2)
        text = self.made("full")
        sample = " (estimated from 50,500 pairs)"
        row = "Touching pairs: FCL, tight boxes, fcl::collide" + sample
        self.assertEqual(self.row(text, row), ["2.0x (2.0 to 2.0)"])
        row = "Touching pairs: FCL, stock boxes, fcl::collide" + sample
        self.assertEqual(self.row(text, row), ["4.0x (4.0 to 4.0)"])
        row = "Touching pairs: FCL, tight boxes, a closed-form capsule test  "
        found = self.row(text.split("## The fastest")[0], row)
        self.assertEqual(found, ["1.5x (1.5 to 1.5)"])

    def test_a_careful_users_test_comes_before_fcls(self):
        """If this failed, ours would be compared first with a way that few take."""
        text = self.page("full")[0]
        for title in ("Speed-up", "The fastest of the others"):
            table = text.split(f"## {title}\n")[1].split("\n## ")[0]
            rows = re.findall(r"^\| (Touching pairs: [^(|;]*[^(|; ])", table, re.MULTILINE)
            self.assertIn("a closed-form capsule test", rows[0])
        scene = text.split("## helix")[1].split("\n## ")[0]
        names = re.findall(r"^\| (DynamicAABBTree[^|]*, tight [^|]* and \w+) ", scene, re.MULTILINE)
        self.assertEqual([name.split()[-1] for name in names], ["test", "collide"])
        touching = self.row(scene, names[0])[7]
        self.assertEqual("~" + touching, self.row(scene, names[1])[7])

    def test_detection_per_visited_pair_counts_both_orders_of_embree(self):
        """If this failed, Embree would be blamed for work that the ratio does not mention."""
        self.take("full", "frames_helix")
        for name in ("rebuild", "morton", "refit"):
            self.set_times(f"Embree/{name}", detection=4, visited=200)
        self.set_times("LayeredAABBTree/boxes", detection=1, visited=100)
        row = "Detection per visited pair: speed-up over Embree, 1 thread"
        self.assertEqual(self.row(self.made("full"), row), ["2.0x (2.0 to 2.0)"])

    def test_arms_tell_who_is_how_fast_with_a_hit_and_without(self):
        """If this failed, the times of poses with a hit would stand for those without one."""
        self.take("full", "frames_helix", "arms")
        cell = "Arms/arm of hulls among 30/"
        for who, factor in (("Dynamic", 6), ("LayeredAABBTree/boxes", 2), ("LayeredAABBTree/c", 3)):
            times = {"hit": 4e-6 * factor, "real_time": 1e-6 * factor, "update": factor / 2 * 1e-6}
            self.put("arms", {cell + who: times})
        text = self.made("full")
        name = "arm of hulls among 30, "
        self.assertEqual(
            self.row(text, name + "update alone")[:3], ["3.00 us, stock", "1.00 us", "1.50 us"]
        )
        found = [cells for cells in map(str.split, text.splitlines()) if "hit" in cells]
        self.assertTrue(any({"24.0", "8.00", "12.0"} <= set(cells) for cells in found))
        self.assertTrue(any({"3.0x", "2.0x"} <= set(cells) for cells in found))

    def test_a_measure_that_was_not_run_is_named(self):
        """If this failed, a part that was left out would look as if it did not exist."""
        self.take("full", "frames_helix")
        for kind in ("headline", "full"):
            others = [one.name for one in SETS[kind] if one.name != "frames_helix"]
            self.assertIn(f"Not measured: {', '.join(others)}.", self.made(kind))

    def test_what_is_wrong_or_missing_ends_the_report(self):
        """If this failed, a broken measurement would be published as far as it got."""

        def without(prefix, key):
            def change(run):
                if run["run_name"].startswith(prefix):
                    del run[key]

            return change

        def renamed(run):
            run["run_name"] = run["run_name"].replace("LayeredAABBTree/boxes", "LayeredAABB/boxes")

        def wrong(run):
            if run["run_name"].startswith("Checked/LayeredAABBTree/boxes/"):
                run["label"] = "wrong: 3 touching pairs instead of 4 in detection"

        runs = []

        def once(run):
            runs.append(run["run_name"])
            return not (run["run_name"].startswith("Frames/") and runs.count(runs[-1]) > 4)

        for change, message in (
            (without("Frames/LayeredAABBTree/boxes/", "detection"), "has no detection"),
            (without("Frames/DynamicAABBTree", "update"), "has no (update|frame)"),
            (without("Checked/", "touching"), "has no touching"),
            (renamed, "no Frames/LayeredAABBTree/boxes"),
            (lambda run: not run["run_name"].startswith("Floor"), "no Floor/read"),
            (wrong, "wrong: 3 touching pairs"),
            (once, "4 runs, not 5"),
        ):
            with self.subTest(message):
                self.take("full", "frames_helix")
                self.edit("frames_helix", change)
                self.assert_fails(message)
        self.take("full", "frames_helix")
        shutil.copy(self.folder / "frames_helix.json", self.folder / "frames_helx.json")
        self.assert_fails("no measure of this name")

    def test_unequal_work_is_not_compared(self):
        """If this failed, who reports fewer pairs would be the faster one."""
        self.take("full", "frames_helix")
        self.set_times("LayeredAABBTree/boxes", pairs=5)
        self.assert_fails("5.0 pairs, DynamicAABBTree")

    def documented(self, kind, **texts):
        """Documents with such texts, once the report has written into them; and its CSV files."""
        docs = self.root / "docs"
        (docs / "images").mkdir(parents=True, exist_ok=True)
        (self.root / "README.md").write_text(texts.pop("readme", ""))
        for name, text in texts.items():
            (docs / f"{name}.md").write_text(text)
        self.made(kind, "--docs", self.root)
        found = {name: (docs / f"{name}.md").read_text() for name in texts}
        found["readme"] = (self.root / "README.md").read_text()
        return found, {path.name: path for path in (docs / "measured").iterdir()}

    MARK = "<!-- table {}: benchmarks/run.sh -->\nold\n<!-- end of table -->\n"

    def test_documents_have_their_marked_tables_replaced(self):
        """If this failed, documents would keep figures of another commit, or lose their text."""
        self.take("headline")
        readme = self.MARK.format("readme")
        costs = self.MARK.format("costs")
        marks = self.MARK.format("headline")
        text, _ = self.documented(
            "headline", readme=readme, a=f"before\n\n{marks}\nafter\n", b=costs
        )
        head = marks.split("old")[0]
        self.assertTrue(text["a"].startswith(f"before\n\n{head}\n| Speed-up over"), text["a"])
        end = "FCL .*; commit abcdef0, code 0123456789ab.\n\n<!-- end of table -->\n\nafter\n$"
        self.assertRegex(text["a"], end)
        self.assertNotIn("old", text["a"] + text["readme"])
        self.assertEqual(text["b"], costs)
        png = (self.root / "docs" / "images" / "headline.png").read_bytes()
        self.assertTrue(png.startswith(b"\x89PNG"))
        (self.root / "README.md").write_text("no mark\n")
        self.assert_fails("no document has a mark", "headline", "--docs", self.root)

    def test_tables_that_no_document_has_are_files_of_their_own(self):
        """If this failed, a table would be lost, or not tell what it is of."""
        self.take("full")
        for path in self.folder.iterdir():
            self.edit(path.stem, lambda run: True, machine="one")
        figure = "It is <!-- =ratios > Update: FCL > * -->old<!-- -->\n"
        marks = self.MARK.format("summary") + self.MARK.format("ratios")
        text, files = self.documented("full", a=marks + figure)
        self.assertIn("scene_helix.csv", files)
        self.assertNotIn("ratios.csv", files)  # a document has it
        with open(files["growth.csv"], newline="") as file:
            rows = list(csv.reader(file))
        self.assertEqual(rows[0][0], "FiberTree, per segment")
        self.assertEqual(len(set(map(len, rows))), 1)
        self.assertRegex(rows[-2][0], "^Helices of 100 segments at one density.")
        self.assertRegex(rows[-1][0], "^`benchmarks/run.sh --full`, .*, code 0123456789ab.$")
        self.assertRegex(text["a"].split("\n")[-2], r"-->\d.*<!-- -->$")

    def test_figures_in_sentences_are_those_of_tables(self):
        """If this failed, a sentence would have a figure that no table has."""
        table = "| | one | two |\n|---|--:|--:|\n| a: b | 4.4x (4.3 to 4.5) | ~31.0 s |\n"
        table += "| a: bc | 0.7 | - |\n| a: d; e | >1,200 | 0.5 to 2 |\n"
        table += "| f | ~2.3 to 29 | 4.0x (1 to 90) |\n| g | as fast (0.95 to 1.1) | 2 ms |\n"
        table = self.MARK.format("t").replace("old\n", table)
        measured, page = self.root / "docs" / "measured", self.root / "docs" / "a.md"
        measured.mkdir(parents=True)
        (measured / "c.csv").write_text('of,who,is\n"2 x, y",boxes,1.07\n"2 x, y",all,9 / 8 %\n')
        (self.root / "README.md").write_text("")

        def filled(*marks):
            marks = [f"of <!-- ={mark} -->old<!-- -->" for mark in marks]
            page.write_text("\n".join([table, *marks]))
            self.assertEqual(figures.fill(self.root, write=False), ["docs/a.md"])
            self.assertTrue(page.read_text().endswith("old<!-- -->"))
            figures.fill(self.root)
            self.assertEqual(figures.fill(self.root), [])
            lines = page.read_text().splitlines()[-len(marks) :]
            return [re.sub("<!--.*?-->", "", line).removeprefix("of ") for line in lines]

        self.assertEqual(filled("t > a: b > one", "t > a: b > two"), ["4.4 times", "~31.0 s"])
        self.assertEqual(filled("t > a: bc > one", "t > a: d > *"), ["0.7", "0.5 to >1,200"])
        self.assertEqual(filled("t > a: bc > *", "t > f > *"), ["0.7", "~2.3 to 29"])
        self.assertEqual(
            filled("c > 2 x, y; boxes > is", "c > 2 x, y; all > is / 2"), ["1.07", "8 %"]
        )
        for mark, error in (
            ("t > a > one", "3 rows begin"),
            ("t > a: b > three", "no column 'three'"),
            ("t > a: bc > two", "no number in the column 'two'"),
            ("t > g > *", "'as fast .*' has no number"),
            ("t > g >", "not complete"),
            ("u > a > one", "no table u"),
        ):
            with self.assertRaisesRegex(ValueError, error):
                filled(mark)
        page.write_text(f"{table}\nText\n  <!-- =t > a: bc > one -->0.7<!-- --> goes on.")
        with self.assertRaisesRegex(ValueError, "ends its paragraph"):
            figures.fill(self.root)

    def test_a_main_table_has_a_column_for_each_machine(self):
        """If this failed, a second machine would replace the first, or hide how old it is."""
        self.take("headline")
        readme = self.MARK.format("readme")
        self.documented("headline", readme=readme)
        other = {"machine": "Zuse Z3, 2 cores", "commit": "1234567", "code": "fedcba987654"}
        self.edit("frames_helix", lambda run: True, **other)
        self.assert_fails("of several machines", "headline", "--docs", self.root)
        for name in ("frames_cap", "frames_paper-dynamic"):
            self.edit(name, lambda run: True, **other)
        text, _ = self.documented("headline", readme=readme)
        head = [line for line in text["readme"].splitlines() if line.startswith("|  ")][0]
        self.assertRegex(head, r"^\| +\| +[^|]+, \w+ \| +Zuse Z3, \w+ \|$")
        sources = (
            r"commit abcdef0, code \w+ \(older\)\..*\nZuse Z3, 2 cores; commit 1234567, code \w+\."
        )
        self.assertRegex(text["readme"], sources)
        cells = self.row(text["readme"], "FCL's fastest tree, closed-form test")
        self.assertEqual(cells[0], cells[1])

    def test_a_part_of_a_set_is_no_least_of_all_scenes(self):
        """If this failed, one scene would stand for three in the README."""
        self.take("full", "frames_helix")
        text, _ = self.documented("headline", readme=self.MARK.format("readme"))
        self.assertIn("old", text["readme"])

    def test_a_main_table_needs_its_own_measures_alone(self):
        """If this failed, a table could not be written before hours of other measures."""
        self.take("full", "obstacles_cables", "clients")
        for source, names in (
            ("frames_helix", ("helix", "helix-2000", "cap", "paper-dynamic")),
            ("obstacles_combed", ("combed", "cap")),
            ("motion_50", (5, 50, 150, 480)),
        ):
            for name in names:
                path = self.folder / f"{source.split('_')[0]}_{name}.json"
                shutil.copy(HERE / "results" / "full" / f"{source}.json", path)
        times = {"arrays": 2.0, "manager": 5.0, "Dynamic": 300.0}
        sets = ("all segments", "without roots")
        times = {f"Touching/{of}/{who}": all_ for of in sets for who, all_ in times.items()}
        for scene in ("combed", "cap"):
            self.set_obstacles(scene, times)
        for path in self.folder.iterdir():
            self.edit(path.stem, lambda run: True, machine="one")
        mark = self.MARK.format("summary")
        text, _ = self.documented("full", a=mark)
        self.assertNotIn("old", text["a"])
        self.assertEqual(self.row(text["a"], "hair that touches")[0], "60x (60 to 60)")
        (self.folder / "motion_5.json").unlink()
        text, _ = self.documented("full", a=mark)
        self.assertIn("old", text["a"])

    def page(self, kind, *flags):
        """Text and page of all that is recorded."""
        self.take(kind)
        return self.page_of_folder(kind, *flags)

    def page_of_folder(self, kind, *flags):
        page, picture = self.root / "page.html", self.root / "picture.png"
        text = self.made(kind, "--page", page, "--picture", picture, *flags)
        self.assertTrue(picture.read_bytes().startswith(b"\x89PNG"))
        return text, page.read_text()

    def headline_rows(self, text):
        """Cells by the row's name."""
        lines = text.split("## Headline\n\n")[1].split("\n\n")[0].splitlines()
        rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
        self.assertEqual(rows[0][1:], ["helix 10 x 20", "cap 20 x 10", "paper-dynamic 40 x 50"])
        return {name: cells for name, *cells in rows[2:]}

    def test_headline(self):
        """If this failed, the first table would lack a scene or a peer, or hide whose boxes."""
        text, page = self.page("headline")
        self.assertNotIn("Not measured", text)
        rows = self.headline_rows(text)
        self.assertEqual(len(rows), 10)
        touching = [name for name in rows if name.startswith("Touching pairs")]
        self.assertIn("a closed-form capsule test", touching[0])
        ratio = r"(as fast|too noisy to tell|[\d.,]+x) \([\d.,]+ to [\d.,]+\)"
        for name, cells in rows.items():
            named = name == "Update: FCL" or name.startswith("Touching pairs: coal")
            boxes = ", (tight|stock)" if named else ""
            for cell in cells:
                self.assertRegex(cell, f"^{ratio}{boxes}$", name)
        self.assertRegex(" ".join(rows), "Embree visits both orders of each pair")
        self.assertIn("<td>Set-up: FCL, boxes written before</td>", page)
        self.assertIn("<td>Set-up: FCL, with its boxes</td>", page)

    def test_the_readme_has_the_least_of_all_scenes(self):
        """If this failed, the README would show the scene in which ours does best."""
        self.take("headline")
        for name in ("helix", "cap", "paper-dynamic"):
            detection = {"helix": 5.0, "cap": 2.0}.get(name, 3.5)
            frame = {"update": 1.0, "detection": detection}
            ours = {"Frames/LayeredAABBTree/capsules/": {**frame, "detection": 0.5}}
            self.put(f"frames_{name}", {"Frames/Embree": frame, **ours})
        readme = self.made("headline").split("\n## ")[0]
        self.assertEqual(self.row(readme, "Embree's fastest tree"), ["2.0"])

    def test_headline_without_embree(self):
        """If this failed, nobody without Embree would get the first table."""
        self.take("headline")
        for name in ("frames_helix", "frames_cap", "frames_paper-dynamic"):
            self.edit(name, lambda run: "/Embree/" not in run["run_name"], left_out="Embree")
        rows = self.headline_rows(self.page_of_folder("headline")[0])
        found = [cells for name, cells in rows.items() if "Embree" in name]
        self.assertEqual(found, 2 * [["not installed"] * 3])
        self.assertEqual(sum("not installed" in cells for cells in rows.values()), 2)

    def test_full(self):
        """If this failed, docs/performance.md could not be made."""
        text, page = self.page("full")
        beside = "FiberTree beside a plain loop"
        titles = ("Speed-up", "The fastest of the others", beside, "Growth")
        for title in titles:
            self.assertIn(f"## {title}\n", text)
            self.assertIn(f"<h2>{title}</h2>", page)
        self.assertIn("## In ten rows\n", text)
        self.assertEqual(self.row(text, "update  ")[:4], ["60.0 ns", "66.0 ns", "90.0 ns", "1.50x"])
        ratio = r"(x|as fast|too noisy to tell) \([\d.]+ to [\d.]+\)$"
        for row in ("boxes: update, times the loop", "spheres: query on 2 threads, times as fast"):
            self.assertRegex(self.row(text, row)[0], ratio)
        for phase in ("Set-up", "Update", "Update + detection"):
            for on in ("1 thread", "2 threads"):
                names = [line for line in text.splitlines() if f"| {phase}: Embree, {on}" in line]
                self.assertEqual(len(names), 2)  # how fast, and which of Embree's ways

    def test_builds_of_fcl_tell_whose_time_has_changed(self):
        """If this failed, a ratio could grow because another build makes FCL slower, unseen."""
        self.take("full", "best_helix_debian", "best_helix_float")
        kept = "FCL 0.7.0, Bullet 3.24, Embree 3.13.5"
        self.edit("best_helix_float", lambda run: True, libraries=kept)
        for name, times in (("debian", (6.0, 2.0)), ("float", (9.0, 2.0))):
            values = dict(zip(("Frames/Dynamic", "Frames/LayeredAABBTree/boxes/"), times))
            values = {start: {"update": seconds} for start, seconds in values.items()}
            self.put(f"best_helix_{name}", values)
        text, files = self.documented("full", a=self.MARK.format("summary"))
        with open(files["best-builds.csv"], newline="") as file:
            rows = {row[0]: row for row in csv.reader(file)}
        (row,) = (row for name, row in rows.items() if name.endswith(": Update: FCL"))
        self.assertRegex(row[1], r"^3\.0x")
        self.assertRegex(row[3], r"^4\.5x")
        row = rows[row[0] + ", time of both"]
        self.assertEqual(row[1:4], ["6.00 s / 2.00 s", "\N{EN DASH}", "9.00 s / 2.00 s"])
        self.assertIn(f"; {kept}, coal 3.0.3; commit", list(rows)[-1])

    def test_managers(self):
        """If this failed, nobody would see where a manager is slower than FCL's."""
        text = self.page("full")[0]
        for title in ("Small scenes", "After changes", "Candidates"):
            self.assertIn(f"## {title}\n", text)
        self.assertIn("9 capsules, self-collision, SpatialHashing, tight (another answer)", text)
        candidates = self.row(text.split("## Candidates\n")[1].split("##")[0], "spheres")
        self.assertEqual(candidates, ["12,946", "1.88", "1.88", "1.88"])

    def test_boxes_of_managers_are_told_without_and_with_writing_them(self):
        """If this failed, FCL's times would lack what a program has to do, and no row would say."""
        self.take("full", "queries")
        asked, ours = "Query/collide, one object/", "LayeredAABBTree/"
        values = {"Objects/": {"set_up": 1.0, "boxes": 3.0}}
        values[asked] = {"real_time": 1.0, "time_unit": "s", "boxes": 3.0}
        values |= dict.fromkeys((f"Objects/spheres/{ours}", asked + ours), {"boxes": 0.0})
        self.put("queries", values)
        text = self.made("full")
        for name, theirs, ratio in (
            ("10,000 spheres, set-up, boxes written before", "1.00 s", "as fast (1.00 to 1.00)"),
            ("10,000 spheres, set-up with boxes", "4.00 s", "4.0x (4.0 to 4.0)"),
            ("collide, one object, box written before", "1.00 s", "as fast (1.00 to 1.00)"),
            ("collide, one object with its box", "4.00 s", "4.0x (4.0 to 4.0)"),
        ):
            row = self.row(text, name)
            self.assertEqual([row[0], row[1], row[3]], ["1.00 s", theirs, ratio])

    def test_changes_are_multiples_of_the_same_run(self):
        """If this failed, the machine's other work would count as a slower query."""
        self.take("full", "clients")
        times = {"real_time": [1300.0, 2600.0, 3900.0], "time_unit": "ms"}
        self.put("clients", {"Changes/": {**times, "reference": [1.0, 2.0, 3.0]}})
        row = self.row(self.made("full"), "2 of 100 fibers")
        self.assertEqual(row[2], "1.3x (1.3 to 1.3)")

    def test_objects_beside_fibers_are_multiples_of_the_same_run(self):
        """If this failed, the machine's other work would count as the cost of a half-space."""
        self.take("full", "shapes")
        times = {"real_time": [1030.0, 2060.0, 3090.0], "time_unit": "ms"}
        values = {"Beside/": {**times, "reference": [1.0, 2.0, 3.0], "with": 0.0}}
        self.put("shapes", {**values, "Beside/kVolumes/tilted": {"with": 200.0}})
        row = self.row(self.made("full"), "tilted half-space")
        self.assertEqual(row, ["as fast (1.03 to 1.03)", "as fast (1.03 to 1.03), 200 pairs"])

    def test_fibers_of_other_shapes_are_multiples_of_capsules(self):
        """If this failed, docs/performance.md would state other ratios than were measured."""
        self.take("full", "shapes")
        own = np.array([1e-3, 2e-3, 3e-3])
        times = {"capsules_update": own, "capsules_detection": own}
        times |= {"update": 1.6 * own, "detection": 2 * own, "bytes": 170 * 200.0}
        self.put("shapes", {"FibersOf/cylinders/": {**times, "segments": 200.0}})
        row = self.row(self.made("full"), "cylinders")
        self.assertEqual(
            [row[0], row[3], row[5]], ["170", "1.6x (1.6 to 1.6)", "2.0x (2.0 to 2.0)"]
        )

    def test_objects_may_have_fewer_pairs_if_as_many_touch(self):
        """If this failed, tighter bounds would be an error, or missing a pair an advantage."""

        def fewer(prefix, key):
            def change(run):
                if run["run_name"].startswith(prefix):
                    run[key] = run[key] / 2

            return change

        for prefix, key, message in (
            ("Objects/spheres/LayeredAABBTree", "answer", ""),
            ("Objects/spheres/Dynamic", "answer", "10,000 spheres, .*: "),
            ("Query/collide, one object/Layered", "answer", "collide, one object.*: "),
            ("Candidates/spheres/poses", "touching", "spheres: 6473.0 touching, FCL 12946.0"),
        ):
            with self.subTest(prefix):
                self.take("full", "queries")
                self.edit("queries", fewer(prefix, key))
                if message:
                    self.assert_fails(message, "full")
                else:
                    self.made("full")

    def set_obstacles(self, scene, times):
        """Runs whose names begin so get these milliseconds, by turns."""
        rest = {"time_unit": "ms", "loop": 0.004, "end": [1.0, 2.0, 3.0, 4.0, 5.0]}
        values = {name: {"real_time": all_, **rest} for name, all_ in times.items()}
        self.put(f"obstacles_{scene}", values)

    def test_obstacles(self):
        """If this failed, docs/performance.md would state other ratios than were measured."""
        self.take("full", "obstacles_combed", "obstacles_cables")
        of = "Touching/all segments/"
        times = {of + "arrays": 2.0, of + "manager": [4.0, 5.0, 6.0], of + "Dynamic": 300.0}
        times |= {of + "turned": 3.0, "Contacts/all": 3.0, "Boxes/ours": 2.0}
        times |= {"Boxes/embree_rebuild": 3.0, "Boxes/embree_morton": 6.0, "Refit/": 10.0}
        self.set_obstacles("combed", times)
        self.set_obstacles("cables", {"Distance/manager": 1.0, "Distance/Dynamic": 9.0})
        tables = self.made("full").split("\n## ", 1)[1]
        found = self.row(tables, "combed, all segments: by the manager")
        self.assertEqual([found[0], found[1], found[3]], ["5.00 ms", "300 ms", "60x (50 to 75)"])
        tree = "^DynamicAABBTree.*, tight level .( [0-9]+ pieces.*)?, fcl::collide$"
        self.assertRegex(found[2], tree)
        found = self.row(tables, "combed: candidates alone")
        self.assertEqual(found[2:], ["embree rebuild", "1.5x (1.5 to 1.5)"])

    def test_obstacles_without_embree(self):
        """If this failed, nobody without Embree would get the table of obstacles."""
        self.take("full", "obstacles_combed")
        self.edit("obstacles_combed", lambda run: "/embree_" not in run["run_name"])
        text = self.made("full")
        self.assertNotIn("candidates alone", text)
        self.assertIn("| combed: refit ", text)
        self.assertIn("obstacles_cap, obstacles_cables", text)

    def test_motion(self):
        """If this failed, docs/performance.md would state another price of motion."""
        self.take("full", "motion_50", "motion_480")
        ours = {"static_query": 0.002, "query": 0.009, "static_update": 0.004, "update": 0.006}
        values = {"Motion/": {"real_time": 30.0}, "Motion/Embree": {"real_time": 60.0}}
        values |= {"Motion/ours/": {**ours, "real_time": 15.0}}
        values |= {"Safe/": {"query": 0.003, "real_time": 1.5, "fraction": 0.25}}
        self.put("motion_50", {**values, "": {"time_unit": "ms"}})
        tables = self.made("full")
        for name, value in (
            ("query of impacts, times the static one", "4.5x (4.5 to 4.5)"),
            ("update, times the static one", "1.5x (1.5 to 1.5)"),
            ("swept boxes: ours", "2.0x (2.0 to 2.0)"),
            ("judged: missed", "0"),
            ("safe step: fraction", "0.25"),
        ):
            self.assertEqual(self.row(tables, name)[0], value)
        # In a gust swept boxes are not measured.
        self.assertEqual(self.row(tables, "swept boxes: ours")[1], "-")
        self.assertIn("motion_5, motion_150,", tables)

    def test_pairs_that_live(self):
        """If this failed, docs/performance.md would state another gain, or hide the set-up."""
        self.take("full", "live_helix", "live_helix-9")
        slow = {"without_step": [0.03, 0.06, 0.03], "with_step": [0.002, 0.002, 0.003]}
        slow |= {"ratio": [14.0, 15.0, 17.0], "ratio_low": 14.5, "ratio_high": 16.0}
        slow |= {"without_total": [12.0, 9.0, 10.0], "with_total": 2.0, "loop": 0.001}
        slow |= {"with_longest": [0.09, 0.06, 0.09], "segments": 1e5, "bytes": 5.9e6}
        slow |= {"listings": 12.0, "uncovered": 2e3}
        slow |= {"touching": 2e5, "tested": 80.0, "tested_touching": 60.0}
        few = {"without_total": 0.93, "with_total": 1.0}
        self.put("live_helix", {"Live/slow/": slow, "Live/weather/": {"segments": 1e5}})
        self.put("live_helix-9", {"Live/fast/": few})
        tables = self.made("full")
        speed, listed = tables.split("## Pairs that live, what is listed\n")
        found = self.row(speed, "helix, 100,000 segments, slow")
        self.assertEqual(found[2:5], ["30.0 ms", "2.00 ms", "15x (14 to 16)"])
        whole, longest, loop = (
            "5.0x (4.5 to 6.0)",
            "too noisy to tell (1.0 to 3.0)",
            "2.0x (2.0 to 3.0)",
        )
        self.assertEqual(found[5:], [whole, longest, loop])
        found = self.row(listed, "helix, 100,000 segments, slow")
        self.assertEqual(found[0], "2.0")
        self.assertEqual(found[-3:], ["0.020", "25 %", "59"])
        found = self.row(speed, "helix, 9 segments, fast")
        self.assertEqual(found[5], "as fast (0.930 to 0.930)")

    def test_managers_and_safe_distances(self):
        """If this failed, a manager would be called a tree, or its gain be another's."""
        self.take("full", "live_helix-objects", "safe-distances")
        both = {"without_total": 10.0, "with_total": 4.0, "segments": 1e5}
        self.put("live_helix-objects", {"LiveObjects/fast/": both})
        self.put("safe-distances", {"SafeDistances/slow/": {"safe": 0.075, "distance": 0.25}})
        tables = self.made("full")
        found = self.row(tables, "FCL's objects, helix, 100,000 segments, fast")
        self.assertEqual(found[5], "2.5x (2.5 to 2.5)")
        listed = tables.split("## Pairs that live, what is listed\n")[1]
        self.assertNotIn("FCL's objects", listed)
        self.assertEqual(self.row(listed, "slow")[2:], ["75.0 ms", "0.25"])

    def test_the_skin_of_pairs_that_live(self):
        """If this failed, docs/trade.md would recommend a skin by other numbers."""
        self.take("trade", "skins")
        narrow = {"without_total": 8.0, "with_total": [1.8, 2.2, 2.0], "steps": 200.0}
        narrow |= {"bytes": 3e6, "segments": 1e5, "listings": 50.0, "motion": 0.2, "skin": 0.5}
        self.put("skins", {"LiveSkins/0.5/fast/": narrow})
        found = self.row(self.made("trade"), "0.20 radii, 0.5 radii")
        self.assertEqual(found, ["4.0x (3.6 to 4.4)", "30", "25", "0.50"])

    def test_live_pairs_that_a_search_does_not_find_end_the_report(self):
        """If this failed, a list would seem fast because it misses pairs."""

        def wrong(run):
            if run["run_name"].startswith("Live/slow/"):
                run.update(error_occurred=True, error_message="in step 3 7 pairs live")

        self.take("full", "live_helix")
        self.edit("live_helix", wrong)
        self.assert_fails("in step 3 7 pairs live", "full")

    def test_documents_keep_what_was_not_measured_again(self):
        """If this failed, --only would end in an error, or empty the other tables of a page."""
        self.take("trade", "skins")
        kept = self.MARK.format("costs")
        text, _ = self.documented("trade", a=kept + self.MARK.format("skins"))
        self.assertTrue(text["a"].startswith(kept))
        rest = text["a"].removeprefix(kept)
        self.assertIn("radii, chosen", rest)
        self.assertNotIn("old", rest)

    def test_trade(self):
        """If this failed, docs/trade.md could not be made, or tell of other settings."""
        text, page = self.page("trade")
        for title in (
            "All dials over all scenes",
            "Trade of the paper's static assembly",
            "Trade of a step of that",
            "What options cost",
            "What tapers and branches cost",
            "Narrow phases",
            "Errors of contacts",
            "Narrow phases at the extremes",
        ):
            self.assertIn(f"## {title}\n", text)
        self.assertEqual(page.count("<img "), 1)

    def test_tapers_and_branches_are_beside_fibers_without(self):
        """If this failed, nobody would know what they cost, or it would hide among the options."""
        self.take("trade", "costs")
        name = "Costs/arrays/boxes, capsules, neighbours by number, branches"
        self.put("costs", {name: {"times": [1.9, 2.1, 2.0, 2.2, 1.9]}})
        costs, tapers = self.made("trade").split("## What tapers and branches cost")
        self.assertEqual(self.row(tapers, "branches, pairs"), ["2.0x (1.9 to 2.2)"])
        self.assertEqual(tapers.count("\n| "), 4)  # header, line, branches and a mesh
        self.assertNotIn("branches", costs)

    def test_a_trade_tells_what_each_setting_costs_and_misses(self):
        """If this failed, a setting would seem to miss less than it does, or to take less."""
        self.take("trade", "trade_static", "trade_dynamic-step")

        def change(run):
            name = run["run_name"]
            run.update(contacts=200.0, judged=50.0, missed=0.0, front=0.0, times_default=1.0)
            run.update({"false": 0.0, "reported": 50.0, "bytes": 4e4, "depth": 1e-16})
            run.update(missed_share=0.0, false_share=0.0)
            if name.endswith("every 8th point, e of 12 radii"):
                run.update(
                    missed=30.0,
                    missed_share=0.15,
                    times_default=0.5,
                    real_time=2e-3,
                    front=1.0,
                    depth=0.25,
                )
            elif "margin: 0.1 radii" in name:
                run.update({"false": 10.0, "false_share": 0.2})
            elif "super thread" in name:
                run["ended"] = 1.0
            elif "neighbours: 2 segments" in name:
                run["times_default"] = 1.2
            elif "FCL's tree: tight boxes, closed form" in name:
                run["bytes"] = 0.0

        self.edit("trade_static", change, segments=400, judged_pieces=10, pieces=40)
        self.edit("trade_dynamic-step", lambda run: run.update(times_default=1.0, bytes=4e4))
        text = self.made("trade")
        dials, static = text.split("## Trade of the paper's static assembly")
        static = static.split("##")[0]
        self.assertIn("400 segments, 2,291 contacts in a sample of 25 %, which may hide ", static)
        found = self.row(static, "sampling: every 8th point, e of 12 radii *")
        self.assertEqual(found[:6], ["2.00 ms", "0.50", "100", "15 %", "0 %", "0.25"])
        self.assertEqual(self.row(static, "margin: 0.1 radii")[4], "20 %")
        self.assertEqual(self.row(static, "tree: boxes, capsules, super thread")[0], "ended")
        self.assertEqual(self.row(static, "FCL's tree: tight boxes, closed form")[2], "-")
        self.assertIn("| neighbours: 2 segments ", static)
        as_usual = static.split("As the first row: ")[1]
        self.assertIn("neighbours: 5 segments", as_usual)
        self.assertNotIn("2 segments", as_usual)
        found = self.row(dials, "sampling: every 8th point  ")
        self.assertEqual(found, ["0.50", "15 %", "0 %", "0.25", "0 of 1"])
        self.assertEqual(self.row(dials, "threads: 2")[-1], "2 of 2")
        self.assertEqual(self.row(dials, "neighbours: length of 19 segments")[-1], "1 of 1")

    def test_narrow_phases(self):
        """If this failed, a solver would look as exact or as fast as another one."""
        self.take("trade", "narrow", "narrow_paper-static")

        def change(run):
            is_ours, is_contact = "/ours/" in run["run_name"], "/contact/" in run["run_name"]
            run.update(missed=0.0 if is_ours else 1234.0, false=5.0)
            run.update(real_time=7e-6 if is_contact else 2e-6, time_unit="ms")
            for what in ("depth", "normal", "point", "way") if is_contact else ():
                run[f"{what}_median"] = 2e-15 if is_ours else math.nan
                run[f"{what}_most"] = 0.5 if is_ours else math.nan

        for name in ("narrow", "narrow_paper-static"):
            self.edit(name, change)
        first, errors, kinds = self.made("trade").split("## ")[1:]
        self.assertEqual(self.row(first, "ours  "), ["2", "7", *5 * ["0, 5"]])
        name = "fcl::collide, FCL's GJK, 1e-6"
        self.assertEqual(self.row(first, name + " "), ["2", "7", *5 * ["1,234, 5"]])
        cells = ["2e-15, 0.50", "1e-13, 29", "2e-15, 0.50", "2e-15, 0.50"]
        self.assertEqual(self.row(errors, "ours, float"), cells)
        self.assertEqual(self.row(errors, name + ", float"), 4 * ["-, -"])
        self.assertEqual(self.row(kinds, "grazing"), ["1,234, 5, -", "0, 5, 0.50"])

    def test_python(self):
        """If this failed, docs/python.md would state other times or ratios than were measured."""
        self.take("python")
        times = {"pairs, 1 thread": 0.05, "contacts, 1 thread": [0.1, 0.2, 0.3, 0.4, 0.5]}
        times |= {"midpoint tree": 2.4, "PyElastica": 8.0, "PyElastica with our tree": 0.2}
        values = {f"Steps/{way}": {"real_time": all_} for way, all_ in times.items()}
        self.put("steps_helix-1000", {**values, "Steps/": {"time_unit": "s"}})

        def leave_out(run):
            if run["run_name"] == "Checked/newton, SAP":
                run["label"] = ">10 s"
            return run["run_name"] != "Steps/newton, SAP" and "scilpy" not in run["run_name"]

        self.edit("steps_helix-1000", leave_out)
        # A turn takes twice as long as another, for both alike. Its quotients stay the same.
        slow = {"python": 1.1, "cpp": 1.0, "cpp_new": 1.25}

        def set_overhead(run):
            who, rest = run["run_name"].removeprefix("Overhead/").split("/", 1)
            run.update(real_time=slow[who] * (1 + run["turn"]), time_unit="s")

        self.edit("overhead_helix-1000", set_overhead)
        modules = {"Import/numpy": 0.1, "Import/fcl_fibers": 0.13}
        self.put("import", {name: {"real_time": time} for name, time in modules.items()})
        tables = self.made("python")
        missing = (
            "Not measured: overhead_bundles-1000, steps_rods-100, steps_rods-300, steps_helix-100, "
        )
        missing += "steps_tract-2000."
        self.assertIn(missing, tables)
        steps, tables = tables.split("## What Python adds")
        self.assertEqual(self.row(steps, "contacts()  ")[2], "300 ms (100 to 500)")
        self.assertRegex(self.row(steps, "SciPy")[2], r"^48x ")
        self.assertRegex(self.row(steps, "PyElastica, RodRodContact")[2], r"^40x ")
        self.assertEqual(self.row(steps, "newton, SAP")[2], ">10 s")
        self.assertEqual(self.row(steps, "scilpy, IntersectionFinder")[2], "-")
        self.assertNotEqual(self.row(steps, "scilpy, IntersectionFinder")[1], "-")
        rows = [line for line in tables.splitlines() if line.startswith("| helix, contacts()")]
        self.assertIn(" 10.0 % (10.0 to 10.0)", rows[0])
        self.assertIn(" -12.0 % (-12.0 to -12.0)", rows[1])
        self.assertEqual(self.row(tables, "import")[2], "30.0 ms (30.0 to 30.0)")

    def test_card(self):
        """If this failed, nobody would see how FCL's managers do on the paper's scenes."""
        text, page = self.page("card")
        self.assertIn("Not measured: card_strand-2000_double, card_dynamic_float, ", text)
        self.assertEqual(page.count("<img "), 1)
        short, static = text.split("\n## ")[:2]
        names = re.findall(r"^\| (\w[^|]*[^| ]) ", static, re.MULTILINE)
        ours = ("LayeredAABBTree", "WrappedSphereTree")
        expected = [f"{tree}, {variant}" for tree in ours for variant in ("bundles", "published")]
        fcls = ("DynamicAABBTree", "DynamicAABBTree Array", "SaP", "SSaP", "IntervalTree")
        for manager in (*fcls, "SpatialHashing", "Naive"):
            expected += [f"{manager}, stock", f"{manager}, tight"]
        self.assertEqual(names, expected)
        self.assertEqual(len(re.findall(r"^\| \w", short, re.MULTILINE)), 4 + 7)
        cells = self.row(short, "FCL SaP")
        self.assertEqual(cells[0], ">20 s in update from 35,000 segments on, stock")
        self.assertEqual(
            cells[1], "not timed: all steps would take about 811 s, stock"
        )  # 100 of 8.11 s
        self.assertIn("at the smallest size already, 39,050 segments", cells[2])

    def set_card(self, scalar, frames=None, climb=None):
        """Counters of Frames rows by contender, and those of Card rows by contender and size."""
        values = {f"Frames/{name}/": of for name, of in (frames or {}).items()}
        values |= {f"Card/{name}/": of for name, of in (climb or {}).items()}
        self.put(f"card_static_{scalar}", values)

    def test_card_has_double_and_float_side_by_side(self):
        """If this failed, a column would have times of the other scalar or of another phase."""
        self.take("card")
        tree = "DynamicAABBTree/tight"
        times = {"set_up": 1.0, "boxes": 0.5, "update": 2.0, "detection": 4.0, "pairs": 7000.0}
        self.set_card("double", {tree: times}, {f"{tree}/100000": {"bytes_after_frames": 90e5}})
        twice = {key: 2 * value for key, value in times.items()}
        self.set_card("float", {tree: twice}, {f"{tree}/100000": {"bytes_after_frames": 60e5}})
        static = self.made("card").split("\n## ")[1]
        found = self.row(static, "DynamicAABBTree, tight")
        cells = ["1.00 s / 2.00 s", "1.50 s / 3.00 s", "2.00 s / 4.00 s", "4.00 s / 8.00 s"]
        cells += ["6.00 s / 12.0 s", "90.0 / 60.0", "7,000 / 14,000"]
        self.assertEqual(found[:7], cells)
        # Ours reads poses and no boxes.
        found = self.row(static, "LayeredAABBTree, bundles")
        self.assertEqual(found[0], found[1])

    def test_card_tells_who_has_ended_and_how_it_grows(self):
        """If this failed, a manager that never ends would look as if it had not been tried."""
        self.take("card")
        sap = "SaP/stock"
        climb = {
            f"{sap}/5000": {"update": 1.0},
            f"{sap}/10000": {"update": 3.0},
            f"{sap}/20000": {"update": 12.0},
        }
        self.set_card("double", climb=climb)
        self.set_card("float", climb={**climb, f"{sap}/35000": {"label": "wrong: 3 missed"}})
        static = self.made("card").split("\n## ")[1]
        found = self.row(static, "SaP, stock")
        self.assertEqual(found[:7], 7 * ["-"])
        # The line through 1, 3 and 12 s, each at twice the segments.
        end = "from 35,000 segments on"
        both = f"double: >20 s in update {end}; it grows as n^1.8; "
        both += f"float: wrong: 3 missed {end}; update grows as n^1.8"
        self.assertEqual(found[7], both)
        found = self.row(static, "SaP, tight")
        end = "crashed in update at the smallest size already, 5,000 segments"
        self.assertEqual(found[7], end)
        # Nobody vanishes without a reason.
        ending = f"Card/{sap}/35000/"
        self.edit("card_static_double", lambda run: not run["run_name"].startswith(ending))
        self.assert_fails("SaP/stock ends without a reason", "card")

    def test_card_compares_with_the_box_tree_over_bundles(self):
        """If this failed, a ratio would be of other numbers than it claims."""
        self.take("card")
        frame = {"update": 1.0, "detection": 1.0}
        frames = {"LayeredAABBTree/bundles": frame, "LayeredAABBTree/published": {**frame}}
        frames["LayeredAABBTree/published"]["detection"] = 5.0
        frames |= {"SSaP/stock": {"update": 7.0, "detection": 1.0}}
        frames |= {"SSaP/tight": {"update": 8.0, "detection": 1.0}}
        self.set_card("double", frames)
        short = self.made("card").split("\n## ")[0]
        self.assertEqual(self.row(short, "LayeredAABBTree, bundles")[0], "2.00 s")
        self.assertEqual(self.row(short, "LayeredAABBTree, published")[0], "about 3.0x, 3 runs")
        self.assertEqual(self.row(short, "FCL SSaP")[0], "about 4.0x, 3 runs, stock")

    def test_card_of_ours_has_to_be_right(self):
        """If this failed, ours could miss pairs in the table that compares it with FCL."""
        self.take("card")
        name = "WrappedSphereTree/bundles/100000"
        self.set_card("double", climb={name: {"label": "wrong: 3 missed"}})
        self.assert_fails(f"{name}: wrong: 3 missed", "card")

    def test_threads_gain_what_medians_say(self):
        """If this failed, a number of threads would gain other than it was measured."""
        self.take("threads")
        seconds = {1: [0.4, 0.38, 0.42, 0.4, 0.4], 2: [0.2, 0.21, 0.19, 0.2, 0.2], 4: 0.5}
        values = {f"Threads/arrays/{n}/": {"build": all_} for n, all_ in seconds.items()}
        self.put("threads_helix", values)
        table = self.made("threads")
        found = self.row(table, "build")
        self.assertEqual(
            found, ["400 ms", "200 ms", "500 ms", "2.0x (1.8 to 2.2)", "0.80x (0.76 to 0.84)"]
        )
        self.assertEqual(self.row(table, "helix, 200 segments")[0], "1 thread")
        self.assertEqual(len(self.row(table, "plain loop over the points")), 5)
        self.assertIn("Not measured: threads_helix-2000, threads_cap.", table)
        for cores, linked in ((2, False), (16, True)):
            self.edit("threads_helix", lambda run: True, machine=f"one, {cores} cores")
            _, files = self.documented("threads")
            self.assertEqual(f"threads_{cores}_cores_helix.csv" in files, linked)

    def test_threads_that_find_other_pairs_end_the_report(self):
        """If this failed, a tree would seem fast because it misses pairs on many threads."""

        def wrong(run):
            if run["run_name"].startswith("Threads/arrays/4/"):
                run.update(error_occurred=True, error_message="query_volumes: 7 instead of 8")

        self.take("threads")
        self.edit("threads_helix", wrong)
        self.assert_fails("7 instead of 8", "threads")

    def test_paper(self):
        """If this failed, the paper's experiments would have no page."""
        text, page = self.page("paper")
        row = self.row(text, "loose strand of 1,000: the paper's boxes")
        none = "not given"
        self.assertEqual(row, ["2.78 s", "281 ms", "1.69 s", none, none, "23,000"])
        for title in ("Fig. 7. Time of construction", "Fig. 10. Dynamic assembly"):
            self.assertIn(f"<h2>{title}</h2>", page)
        self.assertEqual(page.count("<img "), 5)

    def test_paper_takes_what_was_measured_by_itself(self):
        """If this failed, --paper would lose its report, or the trees that take minutes."""
        self.take("paper")
        name = "LayeredAABBTree/super_thread"

        def ended(run):
            if run["run_name"].startswith(f"Checked/{name}/"):
                run["label"] = ">60 s in detection"
                del run["detection"]
            return not run["run_name"].startswith(f"Frames/{name}/")

        self.edit("table_half-scalp", ended)
        row = "half scalp: boxes, as published"
        self.assertRegex(self.row(self.made("paper"), row)[2], r"^\d")
        self.edit("long_half-scalp_LayeredAABBTree", ended)
        text = self.made("paper")
        self.assertRegex(self.row(text, row)[2], r"^>60 s in detection; about \d")
        for row in ("As published / by default, boxes", "The paper's boxes / ours as published"):
            for phase, estimates in (("detection", 1), ("update", 0)):
                cells = self.row(text, f"{row}: {phase}")
                self.assertEqual(sum(cell.startswith("about ") for cell in cells), estimates)

    def test_paper_tells_an_estimate_from_a_count(self):
        """If this failed, a sample of a traversal would stand as the whole."""
        self.take("paper", "table_half-scalp", "tests_half-scalp", "styles_scalp-15")
        row = "half scalp: boxes, as published"
        published = "LayeredAABBTree/super_thread/"
        count = {"volume_tests": 12e6, "share": 1.0, "error": 0.0}
        self.put("tests_half-scalp", {f"VolumeTests/{published}": count})
        self.assertEqual(self.row(self.made("paper"), row)[3], "12.0 M")
        sample = {"volume_tests": 120e6, "share": 0.1, "error": 0.02, "made": 12e6}
        self.put("tests_half-scalp", {f"VolumeTests/{published}": sample})
        found = self.row(self.made("paper"), row)[3]
        self.assertEqual(found, "about 120 M +- 2 % (12.0 M made)")
        self.put("styles_scalp-15", {f"VolumeTests/{published}": sample})
        row = self.row(self.made("paper"), "half scalp: 15 cm, random order")
        self.assertEqual(row[1], "~120 M")
        # 100.531 s of 120 million tests.
        self.assertEqual(row[-1], "838 ns")

    def test_paper_divides_what_its_rows_name(self):
        """If this failed, a ratio would be of other numbers than it claims."""
        self.take("paper", "table_half-scalp", "tests_half-scalp")
        times = {"LayeredAABBTree/super_thread": 2.0, "WrappedSphereTree": 6.0}
        times |= {"LayeredAABBTree/boxes": 0.5}
        values = {f"Frames/{name}": {"detection": seconds} for name, seconds in times.items()}
        self.put("table_half-scalp", values)
        tests = {"LayeredAABBTree": {"volume_tests": 5e7, "share": 1.0}}
        tests |= {"WrappedSphereTree": {"volume_tests": 4e8, "share": 1.0}}
        tests = {f"VolumeTests/{name}/super_thread/": made for name, made in tests.items()}
        self.put("tests_half-scalp", tests)
        for name, pairs in (("LayeredAABBTree", 2e6), ("WrappedSphereTree", 6e6)):
            self.put("table_half-scalp", {f"Checked/{name}/super_thread/": {"pairs": pairs}})
        text = self.made("paper")
        for row, value in (
            ("Spheres / boxes, as published: pairs", "3.0"),  # 6 / 2 million
            ("Our detection with boxes / our volume tests", "40 ns"),  # 2 s / 50 million
            ("Our detection with spheres / our volume tests", "15 ns"),  # 6 s / 400 million
            ("The paper's detection with spheres / our volume tests", "4,962 ns"),  # 1984.78 s
        ):
            self.assertEqual(self.row(text, row), ["-", value])
        row = self.row(text, "Spheres / boxes, as published: detection")
        self.assertEqual(row, ["20", "3.0"])  # 1984.78 s / 100.531 s; 6 s / 2 s
        row = self.row(text, "The paper's boxes / ours as published: detection")
        self.assertEqual(row, ["1", "50"])  # 100.531 s / 2 s
        row = self.row(text, "As published / by default, boxes: detection")
        self.assertEqual(row, ["-", "4.0"])

    def test_paper_answers_claims_with_the_right_numbers(self):
        """If this failed, a claim would be judged by a number of something else."""
        self.take("paper", "static_50", "static_100", "replay")
        published = "Frames/LayeredAABBTree/super_thread/"
        self.put("static_50", {published: {"update": 1.0}})
        self.put("static_100", {published: {"update": 4.0}})
        self.take("paper", "axis_turned_1")
        shutil.copy(self.folder / "axis_turned_1.json", self.folder / "axis_turned_0.json")
        self.put("axis_turned_0", {published: {"detection": 1.0}})
        self.put("axis_turned_1", {published: {"detection": 5.0}})

        def grow_together(run):
            if run["run_name"].startswith("Replay/LayeredAABBTree/super_thread/"):
                for name in [name for name in run if name.startswith("detection:")]:
                    run[name] = -2.0 * run[name.replace("detection", "pairs")]

        self.edit("replay", grow_together)
        claims = self.claims()
        who = "boxes, as published"
        # Twice the segments, four times the time; 5 s / 1 s; and pairs that fall as times grow.
        for claim, value in (
            ("4.1 power of the segments that the update of the static assembly grows with", "2.00"),
            ("2.3 detection of fibers turned by pi/4 twice / of the same along an axis", "5.0"),
            ("4.1 correlation of detection with the pairs reported, by steps of the loop", "-1.0"),
        ):
            self.assertEqual(claims[claim, who], value)

    def claims(self):
        """By claim and of what."""
        rows = self.made("paper").split("## Numbers for single claims")[1].splitlines()
        rows = [[cell.strip() for cell in row.split("|")[1:-1]] for row in rows]
        return {(row[0], row[1]): row[2] for row in rows if len(row) == 3}

    def test_paper_counts_what_it_says_of_cages(self):
        """If this failed, a claim of the paper would be judged by a count of something else."""
        self.take("paper", "cascade_static", "cascade_static_50")
        shutil.copy(self.folder / "cascade_static_50.json", self.folder / "cascade_static_100.json")
        for name, size in (("cascade_static_50", 1e3), ("cascade_static_100", 2e3)):
            tests = [4e9 / size, 8e9 / size, 2e9 / size]
            self.put(
                name,
                {
                    "Root/": {"segments": size, "ball_tests": size**2 / 100},
                    "Cascade/anew/": {"ball_tests": tests, "build": 6.0},
                    "Cascade/anew/exact/": {"build": 3.0},
                    "Cascade/basis/exact/": {"tests": size**2 / 7},
                    "Cascade/boxes/union/": {"build": 2.0},
                },
            )
        claims = self.claims()
        power = "power of the segments that the tests of {} grow with"
        peak = "tests of balls of all spheres, most at a size / least at a size 1.5 times as large"
        for what, who, value in (
            ("2.3 " + power.format("balls of one sphere"), "Welzl", "2.00"),
            ("2.3 tests of balls of one sphere / segments", "Welzl", "10 to 20"),
            ("3 making all spheres by Welzl's algorithm / by the library's", "static", "2.0"),
            ("3.1 " + power.format("cascade verification"), "each leaf", "2.00"),
            ("3.1 bytes of a box, alone and with its basis", "boxes", "48 / 72"),
            (f"4.1 {peak}", "Welzl", "8.0"),
            ("4.1 making all spheres of the static assembly / making its boxes", "Welzl", "3.0"),
        ):
            found = [shown for (row, of), shown in claims.items() if row == what and who in of]
            self.assertEqual(found[:1], [value], what)

        self.put("cascade_static", {"Cascade/boxes/union/": {"update": 2.0}})
        values = {"update": 6.0, "anew": 0.25, "loose": 1.5}
        self.put("cascade_static", {"Cascade/where_it_was/welzl/": values})
        row = "spheres by Welzl, kept where it was while no leaf leaves it"
        self.assertEqual(self.row(self.made("paper"), row), ["3.0 / 25 % / 1.500"])

    def test_paper_writes_no_table_that_no_page_links(self):
        """If this failed, measuring would leave files that the test of links refuses."""
        self.take("paper")
        for path in self.folder.iterdir():
            self.edit(path.stem, lambda run: True, machine="one")
        self.assertIn("## all but straight, turned", self.made("paper"))
        files = self.documented("paper", a=self.MARK.format("table-1"))[1]
        self.assertIn("paper-claims.csv", files)
        self.assertEqual([name for name in files if name.startswith("scene_")], [])

    def test_paper_has_its_figures_in_numbers(self):
        """If this failed, a manager would have another's times, or a single time would pass for a
        median."""
        self.take("paper", "static_50", "static_100", "replay")
        name = "WrappedSphereTree/spheres/"
        self.put("static_100", {f"Frames/{name}": {"detection": 0.25}})
        self.edit("static_50", lambda run: not run["run_name"].startswith(f"Frames/{name}"))
        self.put(
            "static_50", {f"Checked/{name}": {"detection": 0.5, "label": ">0.4 s in detection"}}
        )

        def slow(run):
            if run["run_name"].startswith(f"Replay/{name}"):
                run.update({key: 3.0 for key in run if re.match("(detection|update):", key)})

        self.edit("replay", slow)
        text = self.made("paper")
        self.assertEqual(self.row(text, "detection: spheres  "), ["~500 ms", "250 ms"])
        row = self.row(text, "spheres  ")
        self.assertEqual(row[:2], ["3.00 s / 3.00 s / 3.00 s"] * 2)

    def test_hair_is_named_and_needs_no_picture(self):
        """If this failed, --hair FILE would end in an error, or not tell whose hair it was."""
        self.take("paper", "table_half-scalp")
        (self.folder / "table_half-scalp.json").rename(self.folder / "frames_hair.json")
        self.edit("frames_hair", lambda run: True, scene="tail.tfx")
        text = self.made("paper", "--picture", self.root / "picture.png")
        self.assertIn("| hair (tail.tfx): boxes, as published ", text)
        self.assertFalse((self.root / "picture.png").exists())

    def test_documents_have_the_pictures_of_the_paper_replaced(self):
        """If this failed, docs/paper.md would keep a picture of another commit."""
        self.take("paper", "table_half-scalp", "replay")
        names = ("loop", "half_scalp", "strand", "volumes")
        counts = dict.fromkeys(("fibers", "segments", "touching_pairs", "touching_segments"), 1.0)
        runs = [{"run_type": "iteration", "run_name": f"Picture/{name}"} for name in names]
        runs = [{**run, "real_time": 0.0, "time_unit": "s", **counts} for run in runs]
        document = json.loads((self.folder / "table_half-scalp.json").read_text())
        text = json.dumps({"context": document["context"], "benchmarks": runs})
        (self.folder / "pictures.json").write_text(text)
        for name in names:
            np.random.default_rng(1).random(12, np.float32).tofile(self.folder / f"{name}.points")
            np.array([0, 2, 4], np.int32).tofile(self.folder / f"{name}.begin")
            np.array([0, 1], np.uint8).tofile(self.folder / f"{name}.touching")
        for name in ("volumes", "loop"):
            nodes = "kind,depth,a,b,c,d,e,f\nbox,3,0,0,0,1,1,1\n"
            (self.folder / f"{name}.csv").write_text(nodes)
        self.documented("paper")
        images = self.root / "docs" / "images"
        found = sorted(path.stem for path in images.iterdir())
        names = ("cages", "dynamic", "half_scalp", "replay", "strand", "volumes")
        self.assertEqual(found, [f"paper_{name}" for name in names])


class RunTest(unittest.TestCase):
    """run.sh, where nothing is built, results are copies and nobody reports them."""

    PROGRAM = """#!/usr/bin/python3
import json, os, sys
from pathlib import Path
flags = dict(word.split("=", 1) for word in sys.argv[1:])
out = Path(flags["--benchmark_out"])
with open("calls", "a") as calls:
    calls.write(" ".join(sys.argv[1:-1]) + "\\n")
name = out.name.split(".")[0]
document = json.loads(Path("recorded", f"{name}.json").read_text())
document["context"]["code"] = os.environ["FCL_FIBERS_CODE"]
text = json.dumps(document)
ended = Path("ended").exists()
out.write_text(text[:100] if ended else text)
sys.exit(ended)
"""

    def setUp(self):
        self.root = Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.root)
        self.script("benchmarks/report/report.py", "")
        for name in ("run.sh", "run.py", "sets.py", "report/code_hash.py"):
            shutil.copy(BENCHMARKS / name, self.root / "benchmarks" / name)
        for kind in ("card", "headline"):
            results = HERE / "results" / kind
            shutil.copytree(results, self.root / "recorded", dirs_exist_ok=True)
        for program in ("bench", "headline"):
            self.script(f"build/benchmarks/benchmarks/fcl_fibers_{program}", self.PROGRAM)
        for name in (".ci/apt_install.sh", "bin/cmake"):
            self.script(name, "#!/bin/sh\n")

    def script(self, name, text):
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        path.chmod(0o755)

    def measured(self, *flags, kind="--card --only card_static", code=0):
        """The calls of the program."""
        calls = self.root / "calls"
        calls.write_text("")
        command = [self.root / "benchmarks" / "run.sh", *kind.split(), *flags]
        path = f"{self.root / 'bin'}:/usr/bin:/bin"
        done = subprocess.run(command, capture_output=True, env={"PATH": path})
        self.assertEqual(done.returncode, code, done.stderr)
        return calls.read_text().splitlines()

    def test_what_is_measured_of_this_code_is_kept(self):
        """If this failed, three hours would begin anew, or a table would be of old code."""
        both = [
            f"--measure=card --scene=paper-static --scalar={scalar} --limit=10"
            for scalar in ("double", "float")
        ]
        self.assertEqual(self.measured(), both)
        self.assertEqual(self.measured(), [])
        self.assertEqual(self.measured("--again"), both)
        results = self.root / "build" / "benchmarks" / "results" / "card"
        (self.root / "ended").touch()
        self.assertEqual(self.measured("--again", code=1), both)
        self.assertEqual(list(results.glob("*.json")), [])
        (self.root / "ended").unlink()
        self.assertEqual(self.measured(), both)
        (self.root / "src").mkdir()
        (self.root / "src" / "new.cpp").write_text("changed")
        self.assertEqual(self.measured(), both)

    def test_processes_of_the_readmes_table_are_far_apart(self):
        """If this failed, one slow minute would be in all processes of a scene, or a process would
        take the place of another."""
        results = self.root / "build" / "benchmarks" / "results" / "headline"
        found = self.measured(kind="")
        scenes = [re.search("--scene=([a-z-]*)", call)[1] for call in found]
        self.assertEqual(scenes, 3 * ["helix", "cap", "paper-dynamic"])
        self.assertEqual(len(list(results.glob("*.json"))), 9)
        (results / "frames_cap.2.json").unlink()
        self.assertEqual(self.measured(kind=""), found[1:2])
        shutil.rmtree(results)
        self.assertEqual(self.measured("--processes=1", kind=""), found[:3])

    def refused(self, *flags):
        """What it prints, without having installed or measured anything."""
        shutil.rmtree(self.root / ".ci")
        command = [self.root / "benchmarks" / "run.sh", *flags]
        done = subprocess.run(command, capture_output=True, text=True)
        self.script(".ci/apt_install.sh", "#!/bin/sh\n")
        self.assertEqual(done.returncode, 2, done.stderr)
        return done.stderr

    def test_flags_that_exclude_each_other_are_refused(self):
        """If this failed, minutes would go into another set than the one that was asked for."""
        for flags, message in (
            ("--trade --full", "argument --full: not allowed with argument --trade"),
            ("--card --hair=/dev/null", "--hair does not go with --card"),
            ("--hair /dev/null", "--hair: /dev/null is no file"),
            ("--full --processes=2", "--processes goes with the README's table alone"),
            ("--only frames --hair /dev/null", "--only does not go with --hair"),
            ("--only farmes", "--only farmes: this set has no measure of that name"),
            ("--radius=1", "--radius needs --hair FILE"),
            ("--ful", "unrecognized arguments: --ful"),
        ):
            with self.subTest(flags):
                self.assertIn(
                    f"benchmarks/run.sh: error: {message}\n", self.refused(*flags.split())
                )

    def test_sets_name_each_measure_once(self):
        """If this failed, one of two results would be lost."""
        for kind, measures in SETS.items():
            names = [measure.name for measure in measures]
            self.assertEqual(sorted(set(names)), sorted(names), kind)


if __name__ == "__main__":
    unittest.main()
