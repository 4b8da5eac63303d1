# SPDX-License-Identifier: BSD-3-Clause
"""Reads what fcl_fibers_bench wrote. The names of its results: benchmarks/main.cpp."""

import json
import re

import numpy as np
import pandas as pd

SECONDS = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1}
OURS = ("LayeredAABBTree", "WrappedSphereTree")
TOO_SLOW = ">"  # Notes such as ">10 s in detection" of who was ended.


class Part:
    """One file: the runs of one measure on one scene, by kind and name."""

    def __init__(self, path):
        document = json.loads(path.read_text(encoding="utf-8"))
        self.file, self.context, self.errors = path, document["context"], {}
        rows = {}
        for run in document["benchmarks"]:
            if run["run_type"] == "iteration":
                key = key_of(run)
                if run.get("error_occurred"):
                    self._note_error(*key, run["error_message"])
                else:
                    rows.setdefault(key, []).append(row_of(run))
        self._runs = {key: by_end(pd.DataFrame(found)) for key, found in rows.items()}
        for kind in ("Checked", "Card"):
            for name in self.names(kind):
                note = self.note(name, kind)
                if note and name.startswith(OURS) and not note.startswith(TOO_SLOW):
                    raise RuntimeError(f"{path}: {name}: {note}")

    def _note_error(self, kind, name, message):
        """A peer that is wrong is left out, anything else that is wrong ends the report."""
        if kind not in ("Frames", "Query", "Objects", "Replay") or any(o in name for o in OURS):
            raise RuntimeError(f"{self.file}: {kind}/{name}: {message}")
        self.errors[name] = message

    def names(self, kind):
        return [name for of, name in self._runs if of == kind]

    def has(self, kind, name):
        return (kind, name) in self._runs

    def counters(self, kind, name):
        """Runs in rows by the seconds of their ends, counters in columns."""
        if not self.has(kind, name):
            raise KeyError(f"{self.file}: no {kind}/{name}")
        return self._runs[kind, name]

    def knows(self, kind, name, key):
        """False where the program wrote NaN: a phase that was not reached."""
        counters = self.counters(kind, name)
        if key not in counters:
            raise KeyError(f"{self.file}: {kind}/{name} has no {key}")
        return counters[key].notna().all()

    def runs(self, kind, name, key):
        """The values of all runs."""
        if not self.knows(kind, name, key):
            raise ValueError(f"{self.file}: {kind}/{name}: {key} is not known")
        return self.counters(kind, name)[key]

    def median(self, kind, name, key):
        return self.runs(kind, name, key).median()

    def medians(self, kind, name, *keys):
        return [self.median(kind, name, key) for key in keys]

    def ratios(self, kind, name, key, reference):
        """Multiples of the reference, run by run."""
        return self.runs(kind, name, key) / self.runs(kind, name, reference)

    def title(self, scene):
        """Of hair with the file's name."""
        return f"hair ({self.context['scene']})" if scene == "hair" else scene

    def note(self, name, kind="Checked"):
        """Why it is not timed, or nothing."""
        return self.runs(kind, name, "label").iloc[0]


def key_of(run):
    """Kind and name, without the scene where it ends the name: the file is of one."""
    words = re.split("/(?:iterations:|repeats:|manual_time)", run["run_name"])[0].split("/")
    ends = {"Tried": 3, "Checked": 3, "Frames": 3, "Replay": 3}
    return words[0], "/".join(words[1 : ends.get(words[0])])


def row_of(run):
    row = {key: value for key, value in run.items() if isinstance(value, float)}
    row["seconds"] = row.pop("real_time") * SECONDS[run["time_unit"]]
    row["label"] = run.get("label", "")
    if "update" in row and "detection" in row:
        row["frame"] = row["update"] + row["detection"]
    if "boxes" in row:
        key = "set_up" if "set_up" in row else "seconds"
        row[f"{key}_with_boxes"] = row[key] + row["boxes"]
    return row


def by_end(runs):
    """Where no run tells when it ended, all took turns."""
    if "end" not in runs:
        runs["end"] = (np.arange(len(runs)) + 0.5) / len(runs)
    return runs.set_index("end")


def load(folder, names):
    """Parts by the file's name, in the order of `names`, those of the set. A file of another name
    is an error; a measure that was not run has left no file."""
    paths = {path.stem: path for path in folder.glob("*.json")}
    if not paths:
        raise FileNotFoundError(f"there are no results in {folder}")
    for path in paths.values():
        if path.stem not in names:
            raise ValueError(f"{path}: this set has no measure of this name")
    return {name: Part(paths[name]) for name in names if name in paths}


def told(parts, key):
    """What the contexts of all parts have, each once."""
    found = dict.fromkeys(part.context.get(key, "unknown") for part in parts.values())
    known = [text for text in found if text != "unknown"]
    return " and ".join(known or found)


def libraries_of(parts):
    """With their versions, each once; nothing if no part tells."""
    lists = [part.context.get("libraries", "unknown") for part in parts.values()]
    words = [word for text in lists if text != "unknown" for word in text.split(", ")]
    return ", ".join(dict.fromkeys(words))


def circumstances(parts, beside=None):
    """One line: machine, compiler, build type, versions of libraries, commit and hash of code.
    `beside`: parts of the same set, which tell the libraries that these do not."""
    machine, compiler, build_type, commit, code = (
        told(parts, key) for key in ("machine", "compiler", "build_type", "commit", "code")
    )
    libraries = libraries_of(parts) or libraries_of(beside or {})
    libraries = f"{libraries}; " if libraries else ""
    return f"{machine}; {compiler}, {build_type}; {libraries}commit {commit}, code {code}."
