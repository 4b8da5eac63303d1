# SPDX-License-Identifier: BSD-3-Clause
"""Reads what fcl_fibers_paper wrote, as far as it got."""

import csv
import json
import math
import statistics
from dataclasses import dataclass, field
from pathlib import Path

PHASES = ("SetUp", "Update", "SelfCollision")
CHECKED_SECONDS = dict(zip(PHASES, ("seconds_set_up", "seconds_update", "seconds_self_collision")))


@dataclass
class Entry:
    """One manager in one scene."""

    seconds: dict = field(default_factory=dict)  # by phase, medians
    checked: dict = field(default_factory=dict)  # counters of the check
    counters: dict = field(default_factory=dict)  # counters of Replay/ and Chain/, see _over_runs
    total: float = math.nan  # median seconds of Replay/ and Chain/
    note: str = ""  # why it is not timed

    def time(self, phase):
        """Median seconds, and whether it is such and not a single time."""
        if phase in self.seconds:
            return self.seconds[phase], not self.note
        once = self.checked.get(CHECKED_SECONDS[phase], math.nan)
        return (math.nan if once is None else once), False

    def ended_in(self, phase):
        return bool(self.note) and self.checked.get("ended_in_phase") == PHASES.index(phase)

    def median(self, phase):
        return self.seconds.get(phase, math.nan)


class Part:
    """One file: the managers of one scene, by `manager/variant`."""

    def __init__(self, path):
        document = _read_json(path)
        self.name = path.stem
        self.context = document.get("context", {})
        self.entries = {}
        self.rows = {}  # Radii/...: counters by name
        runs = [b for b in document.get("benchmarks", []) if b["run_type"] == "iteration"]
        for run_name in dict.fromkeys(b["run_name"] for b in runs):
            self._add(run_name, [b for b in runs if b["run_name"] == run_name])
        self.empty = not runs

    def _add(self, run_name, runs):
        words = run_name.split("/")
        if words[0] == "Radii":
            self.rows["/".join(words[1:3])] = runs[0]
            return
        runs = [run for run in runs if not run.get("error_occurred")]
        if not runs:
            return
        entry = self.entries.setdefault("/".join(words[1:3]), Entry())
        scale = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1}[runs[0]["time_unit"]]
        median = scale * statistics.median(run["real_time"] for run in runs)
        if words[0] == "Checked":
            entry.checked = runs[0]
            entry.note = runs[0].get("label", "")
        elif words[0] in PHASES:
            entry.seconds[words[0]] = median
        else:
            entry.total = median
            numbers = {k for run in runs for k, v in run.items() if isinstance(v, float)}
            entry.counters = {k: _over_runs(k, [r[k] for r in runs if k in r]) for k in numbers}


def _over_runs(counter, values):
    """Times of one step are too short for medians of a few replays to be quiet: the least of them
    is what other programs have disturbed least."""
    is_time = counter.startswith(("update:", "detection:"))
    return min(values) if is_time else statistics.median(values)


def load_parts(folder):
    parts = {}
    for path in sorted(Path(folder).glob("*.json")):
        part = Part(path)
        if not part.empty:
            parts[part.name] = part
    _merge_long_runs(parts)
    return parts


def _merge_long_runs(parts):
    """`SCENE_long_N` holds managers that were given more time than SCENE gave them."""
    for name in [name for name in parts if "_long_" in name]:
        part = parts.pop(name)
        entries = parts.setdefault(name.split("_long_")[0], part).entries
        for manager, entry in part.entries.items():
            if manager not in entries or (entries[manager].note and not entry.note):
                entries[manager] = entry


def numbered(parts, prefix):
    """Parts `prefix_N`, by N, ascending."""
    found = {}
    for name, part in parts.items():
        number = name[len(prefix) + 1 :]
        if name.startswith(prefix + "_") and number.isdigit():
            found[int(number)] = part
    return dict(sorted(found.items()))


def read_csv(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def _read_json(path):
    """A file whose writer was ended holds the benchmarks up to some point."""
    text = path.read_text(encoding="utf-8")
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        pass
    for end in ("\n    },\n", "\n    }\n"):
        cut = text.rfind(end)
        if cut >= 0:
            try:
                return json.loads(text[:cut] + "\n    }\n  ]\n}\n")
            except json.JSONDecodeError:
                pass
    return {}
