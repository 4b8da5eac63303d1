#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""How steps.sh tells what passed, what failed and what was not run; and whether every step runs."""

import re
import subprocess
import tempfile
import unittest
from pathlib import Path

TESTS = Path(__file__).resolve().parent
STEPS = TESTS / "steps.sh"
SCRIPT = f"""#!/usr/bin/env bash
set -euo pipefail
. {STEPS}
fine() {{ skip "a part" && tell "tables are old"; }}
breaks() {{ false; echo "went on"; }}
ends_as_skipped() {{ bash -c "exit 77"; }}
waits() {{
  local turn
  turn=$(turn_of 2)
  ((turn == 1)) || skip_step "it is not its turn"
  echo "it ran"
}}
run_steps "$@"
"""


class Steps(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.project = self.folder / "project"
        self.project.mkdir()

    def git(self, *arguments):
        names = ["-c", "user.name=somebody", "-c", "user.email=somebody"]
        subprocess.run(["git", *names, *arguments], cwd=self.project, check=True)

    def commit(self, commits):
        self.git("init", "-q")
        for number in range(commits):
            self.git("commit", "-q", "--allow-empty", "-m", str(number))

    def run_steps(self, *steps, code):
        done = subprocess.run(
            ["bash", "-c", SCRIPT, "steps", *steps],
            cwd=self.project,
            capture_output=True,
            encoding="utf-8",
            env={"PATH": "/usr/bin:/bin", "GIT_CEILING_DIRECTORIES": str(self.folder)},
        )
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done

    def test_all_run_and_are_told_apart(self):
        self.commit(2)
        out = self.run_steps("breaks", "waits", "fine", code=1).stdout
        self.assertNotIn("went on", out)
        self.assertNotIn("it ran", out)
        self.assertRegex(out, "FAILED  breaks\n")
        self.assertRegex(out, "skipped  waits\n")
        self.assertRegex(out, "passed  fine\n")
        self.assertIn("\nskipped: waits: it is not its turn\nskipped: fine: a part\n", out)
        self.assertIn("\ntables are old\n", out.split("== Summary ==")[1])
        self.assertIn("Steps: 1 passed, 1 failed, 1 skipped\n", out)
        self.run_steps("waits", "fine", code=0)

    def test_a_program_cannot_skip_a_step(self):
        """libFuzzer ends with 77 where an input fails, and tests where they lack something."""
        self.commit(2)
        out = self.run_steps("waits", "fine", "ends_as_skipped", code=1).stdout
        self.assertIn("FAILED  ends_as_skipped\n", out)

    def test_a_step_runs_at_its_turn(self):
        self.commit(3)
        out = self.run_steps("waits", code=0).stdout
        self.assertIn("it ran\n", out)
        self.assertIn("passed  waits\n", out)

    def test_fails_where_commits_cannot_be_counted(self):
        """The steps that take turns would pass without a run, or be the same for ever."""
        done = self.run_steps("waits", code=1)  # no repository
        self.assertNotIn("it ran", done.stdout)
        self.assertIn("FAILED  waits\n", done.stdout)
        self.assertIn("whole history", done.stderr)
        self.commit(3)
        whole, self.project = self.project, self.folder / "shallow"
        self.project.mkdir()
        self.git("clone", "-q", "--depth", "1", f"file://{whole}", ".")
        done = self.run_steps("waits", code=1)
        self.assertIn("git fetch --unshallow", done.stderr)
        self.git("fetch", "-q", "--unshallow")
        self.run_steps("waits", code=0)

    def test_each_step_of_the_full_run_runs_at_night(self):
        full = (TESTS / "full.sh").read_text(encoding="utf-8")
        steps = re.search(r"^steps=\(\n(.*?)^\)", full, re.M | re.S)[1].split()
        nightly = TESTS.parent / ".github/workflows/nightly.yml"
        text = nightly.read_text(encoding="utf-8")
        parts = re.findall(r"- \{ step: (\w+), part: (\d+)/(\d+) \}", text)
        whole = re.findall(r"^          - (\w+)$", text, re.M)
        self.assertEqual(sorted({*whole, *(step for step, *_ in parts)}), sorted(steps))
        self.assertEqual(len(whole), len(set(whole)))
        for step, _, count in parts:
            numbers = [int(number) for name, number, n in parts if (name, n) == (step, count)]
            self.assertEqual(numbers, list(range(1, int(count) + 1)))


if __name__ == "__main__":
    unittest.main()
