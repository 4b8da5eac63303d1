# SPDX-License-Identifier: BSD-3-Clause
"""A count of volume tests that ran out of time estimates the whole: PROGRAM"""

import json
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

PROGRAM = sys.argv.pop()
SCENE = "paper-half-scalp:fibers=10000,length=7,wisp_fibers=300"
WHO = "VolumeTests/LayeredAABBTree/super_thread/"


def count(limit):
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out.json"
        flags = ["--measure=volume-tests", f"--scene={SCENE}", f"--limit={limit}"]
        flags += ["--against=paper:LayeredAABBTree/super_thread", f"--benchmark_out={out}"]
        subprocess.run([PROGRAM, *flags], check=True, capture_output=True)
        runs = json.loads(out.read_text())["benchmarks"]
    return next(run for run in runs if run["name"].startswith(WHO))


class SampledCountTest(unittest.TestCase):
    def test_estimate_is_near_the_count(self):
        """If this failed, tables would have estimates that are off by more than they say."""
        whole, sample = count(1000), count(0.3)
        self.assertEqual(whole["share"], 1)
        self.assertEqual(whole["made"], whole["volume_tests"])
        self.assertLess(sample["share"], 0.9)
        self.assertLess(sample["made"], 0.95 * whole["volume_tests"])
        # The tests that cut the traversal into parts are counted whole, and are no sample.
        self.assertLess(sample["volume_tests"], 0.999 * sample["made"] / sample["share"])
        self.assertGreater(sample["error"], 0)
        self.assertLess(sample["error"], 0.2)
        # The order of the sample is fixed and its size is not. Five standard errors are met by
        # less than one size in a million.
        off = abs(sample["volume_tests"] / whole["volume_tests"] - 1)
        self.assertLess(off, 5 * sample["error"])


if __name__ == "__main__":
    unittest.main()
