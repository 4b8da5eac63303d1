#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What `fcl_fibers trade` finds on a scene, in the form of Google Benchmark's results:

    Trade/DIAL: VALUE   the median of a frame, and what the setting misses, adds and holds

benchmarks/run.sh --trade calls it.
"""

import argparse
import json
import os
import subprocess
from pathlib import Path


def run_of(row):
    """One result: all numbers are floats, as Google Benchmark writes them."""
    run = {"run_type": "iteration", "run_name": f"Trade/{row['dial']}: {row['value']}"}
    run |= {"real_time": row.get("seconds", 0.0), "time_unit": "s"}
    for key in ("ended", "front", "times_default", "bytes", "reported", "contacts", "missed"):
        run[key] = float(row.get(key) or 0)
    for key in ("judged", "false", "missed_share", "missed_share_at_most", "false_share"):
        run[key] = float(row.get(key) or 0)
    for what in ("depth", "normal", "place"):
        errors = row.get(f"{what}_error", {})
        run[what] = float(errors["median"]) if errors.get("count") else float("nan")
        run[f"{what}_worst"] = float(errors["worst"]) if errors.get("count") else float("nan")
    return run


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--measure", choices=("trade",), required=True)
    parser.add_argument("--program", help="fcl_fibers", required=True)
    parser.add_argument("--context", type=Path, help="a result of the same machine", required=True)
    parser.add_argument("--benchmark_out", type=Path, metavar="FILE.json", required=True)
    options, words = parser.parse_known_args()
    known = {}
    if options.context.exists():
        known = json.loads(options.context.read_text(encoding="utf-8"))["context"]
    done = subprocess.run(
        [options.program, "trade", *words, "--again", "--json"],
        check=True,
        stdout=subprocess.PIPE,
        encoding="utf-8",
    )
    answer = json.loads(done.stdout)
    keys = ("machine", "compiler", "build_type", "left_out")
    context = {key: known.get(key, "unknown") for key in keys}
    context["commit"] = os.environ.get("FCL_FIBERS_COMMIT", "unknown")
    context["code"] = os.environ.get("FCL_FIBERS_CODE", "unknown")
    for key in ("scene", "question", "fibers", "segments", "contacts", "pieces", "judged_pieces"):
        context[key] = answer[key]
    runs = [run_of(row) for row in answer["rows"]]
    text = json.dumps({"context": context, "benchmarks": runs}, indent=1)
    options.benchmark_out.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
