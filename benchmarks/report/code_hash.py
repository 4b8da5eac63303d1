#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Prints a hash of the code that figures are of, the files of src, include, scenes and benchmarks:

    code_hash.py [ROOT]

It tells whether a table is of this code where the commit alone does not: after a commit that
changes documents only, or with changes that are not committed. What measures nothing is left out:
run.sh and run.py, which build and call the programs, and benchmarks/report, which makes tables of
results.
"""

import hashlib
import subprocess
import sys
from pathlib import Path

FOLDERS = ("src", "include", "scenes", "benchmarks")
AROUND = ("benchmarks/report/", "benchmarks/run.")
ROOT = Path(__file__).resolve().parents[2]


def git(root, *words):
    """What git prints, or nothing where it fails."""
    done = subprocess.run(["git", "-C", root, *words], capture_output=True, check=False)
    return done.stdout if done.returncode == 0 else b""


def blob(content):
    """Git's name of such a content, so that a commit's files need not be read."""
    return hashlib.sha1(b"blob %d\0" % len(content) + content).hexdigest()


def files_of_tree(root=ROOT):
    """The names of contents by the names of files, those that git ignores left out. An archive
    without git's folder has all of its files."""
    found = []
    if (root / ".git").exists():
        flags = ("--cached", "--others", "--exclude-standard", "-z")
        found = git(root, "ls-files", *flags, *FOLDERS).decode().split("\0")
    paths = [root / name for name in found if name]
    if not paths:
        paths = [path for folder in FOLDERS for path in (root / folder).rglob("*")]
    paths = [path for path in paths if path.is_file() and "__pycache__" not in path.parts]
    return {path.relative_to(root).as_posix(): blob(path.read_bytes()) for path in paths}


def files_of_commit(commit, root=ROOT):
    """The names of contents by the names of files in a commit; nothing where the history is not
    here."""
    lines = git(root, "ls-tree", "-r", "-z", commit, *FOLDERS).decode().split("\0")
    entries = [line.split("\t", 1) for line in lines if line]
    return {name: head.split()[2] for head, name in entries}


def is_measured(name):
    return not name.startswith(AROUND)


def hash_of(files, chosen=is_measured):
    """Of the files that are chosen by their names."""
    names = filter(chosen, sorted(files))
    text = "".join(f"{files[name]} {name}\n" for name in names)
    return hashlib.sha256(text.encode()).hexdigest()[:12]


if __name__ == "__main__":
    print(hash_of(files_of_tree(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT)))
