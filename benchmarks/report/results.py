# SPDX-License-Identifier: BSD-3-Clause
"""Reads what fcl_fibers_bench wrote. The names of its results: benchmarks/main.cpp."""

import json
import re

import numpy as np
import pandas as pd

SECONDS = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1}
OURS = ("LayeredAABBTree", "WrappedSphereTree")
TOO_SLOW = ">"  # Notes such as ">10 s in detection" of who was ended.


class Process:
    """One file: the runs of one measure in one process, by kind and name."""

    def __init__(self, path, number=1):
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
        self.runs = {key: by_end(pd.DataFrame(found), number) for key, found in rows.items()}

    def _note_error(self, kind, name, message):
        """A peer that is wrong is left out, anything else that is wrong ends the report."""
        if kind not in ("Frames", "Query", "Objects", "Replay") or any(o in name for o in OURS):
            raise RuntimeError(f"{self.file}: {kind}/{name}: {message}")
        self.errors[name] = message


class Part:
    """One measure on one scene: its runs by kind and name, of one process or of several."""

    def __init__(self, processes):
        self._processes = processes
        self.file, self.context = processes[0].file, processes[0].context
        self.contexts = [one.context for one in processes]
        self.errors = {name: why for one in processes for name, why in one.errors.items()}
        for kind in ("Checked", "Card"):
            for name in self.names(kind):
                note = self.note(name, kind)
                if note and name.startswith(OURS) and not note.startswith(TOO_SLOW):
                    raise RuntimeError(f"{self.file}: {name}: {note}")

    def processes(self):
        """A part for each process."""
        return [Part([one]) for one in self._processes]

    def names(self, kind):
        names = [name for one in self._processes for of, name in one.runs if of == kind]
        return list(dict.fromkeys(names))

    def has(self, kind, name):
        return any((kind, name) in one.runs for one in self._processes)

    def counters(self, kind, name):
        """Runs in rows by process and the seconds of their ends, counters in columns."""
        return pd.concat(self._of(kind, name))

    def _of(self, kind, name):
        """By process. One may lack it, because each chooses among the trees that it has tried."""
        found = [one.runs[kind, name] for one in self._processes if (kind, name) in one.runs]
        if not found:
            raise KeyError(f"{self.file}: no {kind}/{name}")
        return found

    def _known(self, kind, name, key):
        """By process. A program wrote NaN of a phase that was not reached."""
        found = self._of(kind, name)
        if key not in found[0]:
            raise KeyError(f"{self.file}: {kind}/{name} has no {key}")
        return [counters[key] for counters in found if counters[key].notna().all()]

    def knows(self, kind, name, key):
        return bool(self._known(kind, name, key))

    def runs(self, kind, name, key):
        """The values of all runs."""
        known = self._known(kind, name, key)
        if not known:
            raise ValueError(f"{self.file}: {kind}/{name}: {key} is not known")
        return pd.concat(known)

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


def by_end(runs, process):
    """Where no run tells when it ended, all took turns."""
    if "end" not in runs:
        runs["end"] = (np.arange(len(runs)) + 0.5) / len(runs)
    return runs.assign(process=process).set_index(["process", "end"])


def load(folder, names):
    """Parts by the file's name, in the order of `names`, those of the set. The files of a measure
    in several processes are NAME.json, NAME.2.json and so on. A file of another name is an error; a
    measure that was not run has left no file."""
    found = {}
    for path in sorted(folder.glob("*.json"), key=lambda path: path.stem):
        name, _, number = path.stem.partition(".")
        if name not in names or not re.fullmatch("[2-9]?", number):
            raise ValueError(f"{path}: this set has no measure of this name")
        found.setdefault(name, []).append(Process(path, int(number or 1)))
    if not found:
        raise FileNotFoundError(f"there are no results in {folder}")
    return {name: Part(found[name]) for name in names if name in found}


def told(parts, key):
    """What the contexts of all parts have, each once."""
    contexts = [context for part in parts.values() for context in part.contexts]
    found = dict.fromkeys(context.get(key, "unknown") for context in contexts)
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
