#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Prints a hash of the code that figures are of, the files of src, include, scenes and benchmarks:

    code_hash.py [ROOT]

It tells whether a table is of this code where the commit alone does not: after a commit that
changes documents only, or with changes that are not committed. What measures nothing is left out:
run.sh and run.py, which build and call the programs, benchmarks/report, which makes tables of
results, and comments and the width of white space in C++.
"""

import hashlib
import io
import re
import subprocess
import sys
import tarfile
from functools import lru_cache
from pathlib import Path

FOLDERS = ("src", "include", "scenes", "benchmarks")
AROUND = ("benchmarks/report/", "benchmarks/run.")
ROOT = Path(__file__).resolve().parents[2]

# What stays as it is, and what is left out.
CPP = re.compile(
    rb"""(?P<kept>R"(?P<mark>[^\s()\\]*)\(.*?\)(?P=mark)" | "(?:\\.|[^"\\\n])*"
                | (?<!\w)'(?:\\.|[^'\\\n])+')
      | (?://[^\n]* | /\*.*?\*/ | \s)+""",
    re.DOTALL | re.VERBOSE,
)


def git(root, *words):
    """What git prints, or nothing where it fails."""
    done = subprocess.run(["git", "-C", root, *words], capture_output=True, check=False)
    return done.stdout if done.returncode == 0 else b""


def as_it_is(_, content):
    return content


def without_comments(name, content):
    """C++ with each run of comments and white space as one space. Lines end only around what is for
    the preprocessor."""
    if not name.endswith((".cpp", ".h")):
        return content

    def kept(match):
        return match["kept"] or (b"\n" if b"\n" in match[0] else b" ")

    lines = CPP.sub(kept, content.replace(b"\\\n", b" ")).strip().split(b"\n")
    return b" ".join(b"\n" + one + b"\n" if one.startswith(b"#") else one for one in lines)


@lru_cache(maxsize=None)
def blob(name, content, form):
    """Git's name of what counts of a content."""
    counted = form(name, content)
    return hashlib.sha1(b"blob %d\0" % len(counted) + counted).hexdigest()


def files_of_tree(root=ROOT, form=without_comments):
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
    names = {path.relative_to(root).as_posix(): path for path in paths}
    return {name: blob(name, path.read_bytes(), form) for name, path in names.items()}


def files_of_commit(commit, root=ROOT, form=without_comments):
    """The names of contents by the names of files in a commit; nothing where the history is not
    here."""
    # A folder that a commit lacks would end git archive.
    names = git(root, "ls-tree", "-z", "--name-only", commit, *FOLDERS).decode().split("\0")
    folders = [name for name in names if name]
    archive = git(root, "archive", "--format=tar", commit, *folders) if folders else b""
    if not archive:
        return {}
    with tarfile.open(fileobj=io.BytesIO(archive)) as tar:
        members = [member for member in tar if member.isfile()]
        return {m.name: blob(m.name, tar.extractfile(m).read(), form) for m in members}


def is_measured(name):
    return not name.startswith(AROUND)


def hash_of(files, chosen=is_measured):
    """Of the files that are chosen by their names."""
    names = filter(chosen, sorted(files))
    text = "".join(f"{files[name]} {name}\n" for name in names)
    return hashlib.sha256(text.encode()).hexdigest()[:12]


if __name__ == "__main__":
    print(hash_of(files_of_tree(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT)))
