#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Compares the includes of src/, include/, tools/ and python/src/ with the rooms in
docs/architecture.md.

If this fails, a file includes what its room may not see, or the page no longer says what is so.
"""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
PAGE = ROOT / "docs" / "architecture.md"
INCLUDE = re.compile(r"^\s*#\s*(?:include|include_next|import)\b\s*(.*)$", re.MULTILINE)
NAMED = re.compile(r'<([^>"]+)>|"([^>"]+)"')
# Headers of C++'s library have neither a folder nor a suffix.
STANDARD = re.compile(r"[a-z_]+")

# Public headers that need FCL; those in folders are sets of their own, all others the tree's.
MANAGERS = {
    "contact_collector.h",
    "eigen_alignment.h",
    "export.h",
    "fiber_collision_manager.h",
    "fiber_manager_options.h",
    "fiber_objects.h",
    "impact_collector.h",
    "layered_aabb_tree_collision_manager.h",
    "shadow_manager.h",
    "wrapped_sphere_tree_collision_manager.h",
}
PUBLIC = {
    "include/tree": {"include/tree"},
    "include/managers": {"include/managers", "include/tree", "<fcl>", "<Eigen>"},
    "include/io": {"include/io", "include/tree"},
    "include/benchmark": {"include/benchmark", "include/managers", "include/tree", "<fcl>"},
}
# Libraries that the table does not name by the first part of their headers' path.
LIBRARIES = {
    "oneapi": "<tbb>",
    "pugixml.hpp": "<pugixml>",
    "zlib.h": "<zlib>",
}
TOP = "src/*.h"
TOOLS = "tools"
TRADE = "tools/trade"
PYTHON = "python/src"
FOLDERS = {f"src/{folder.name}" for folder in (ROOT / "src").iterdir() if folder.is_dir()}
TOP_FILES = {f"src/{file.name}" for file in ROOT.glob(TOP)}


def set_of(public_header):
    """The set of a header, named as in `#include <fcl_fibers/...>`."""
    for folder in ("io", "benchmark"):
        if public_header.startswith(f"{folder}/"):
            return f"include/{folder}"
    return "include/managers" if public_header in MANAGERS else "include/tree"


def rooms():
    """What each room may include, in the order of the table, itself included."""
    allowed = {}
    for line in PAGE.read_text().splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        named = r"`(src/(\w+|\*\.h)|tools(/trade)?|python/src)`"
        if len(cells) == 3 and re.fullmatch(named, cells[0]):
            room = cells[0].strip("`")
            allowed[room] = {room} | set(re.findall(r"`([^`]+)`", cells[2]))
    return allowed


def target(what, path):
    """What an include leads to, in the words of the table; None for the standard library."""
    named = NAMED.match(what)
    if not named or ".." in what:
        return "a name that this test cannot read"
    name = named[1] or named[2]
    first = name.split("/")[0]
    if named[2] and path.parent == ROOT / PYTHON:
        return PYTHON if (path.parent / name).exists() else first
    if named[2] and path.relative_to(ROOT).parts[0] == TOOLS:
        return target_of_tools(name, path)
    if name == "fcl_fibers/tree_export.h":
        return None
    if name.startswith("fcl_fibers/"):
        return set_of(name.split("/", 1)[1])
    # Angle brackets find the files of src/, too.
    if named[2] or f"src/{first}" in FOLDERS | TOP_FILES:
        return f"src/{first}"
    if STANDARD.fullmatch(name):
        return None
    return LIBRARIES.get(first, f"<{first}>")


def target_of_tools(name, path):
    for folder in (path.parent, ROOT, ROOT / "src"):
        if (folder / name).exists():
            found = (folder / name).relative_to(ROOT)
            room = found.parent.as_posix()
            return room if room in (TOOLS, TRADE) else found.as_posix()
    return TOOLS if name == "embedded.h" else f"the unknown file {name}"


def main():
    allowed = rooms()
    problems = []
    for room in sorted((FOLDERS | {TOP, TOOLS, TRADE, PYTHON}) ^ set(allowed)):
        problems.append(f"{room}: it has to be a folder, and in the table of docs/architecture.md")
    above = set()
    for room, targets in allowed.items():
        above |= {room} | (TOP_FILES if room == TOP else set())
        for other in sorted(t for t in targets if t.startswith("src/") and t not in above):
            problems.append(f"{room}: {other} does not stand above it in the table")

    files = 0
    libraries = [*ROOT.glob("src/**/*"), *ROOT.glob("include/**/*")]
    programs = [path for room in (TOOLS, TRADE, PYTHON) for path in (ROOT / room).glob("*")]
    for path in sorted([*libraries, *programs]):
        if path.suffix not in (".h", ".cpp"):
            continue
        files += 1
        relative = path.relative_to(ROOT)
        if relative.parts[0] == "include":
            room = set_of("/".join(relative.parts[2:]))
            may = PUBLIC[room]
        elif relative.parts[0] == "src":
            room = "/".join(relative.parts[:2]) if len(relative.parts) > 2 else TOP
            may = allowed.get(room, set())
        else:
            room = relative.parent.as_posix()
            may = allowed.get(room, set())
        for what in INCLUDE.findall(path.read_text()):
            leads_to = target(what, path)
            if leads_to is not None and leads_to not in may:
                problems.append(f"{relative}: includes {what} of {leads_to}, which {room} may not")
    if files < 50:
        problems.append(f"only {files} files were found; the test looks in the wrong place")
    for problem in problems:
        print(problem, file=sys.stderr)
    sys.exit(1 if problems else 0)


if __name__ == "__main__":
    main()
