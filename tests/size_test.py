#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Holds the shared libraries to tests/size_budget.json: the bytes of their text, as `size` counts
them, and how often each template of src/tree is instantiated, over all instruction sets.

    tests/size_test.py [LIBRARY...]   those of build/release/src unless given
    tests/size_test.py --write        writes the budget anew

Every query compiled for every tree and instruction set makes a library that takes minutes to build,
and no test notices what one template more adds. A figure may be 2 % off either way, so that a gain
is recorded too. A commit that writes the budget says why. Figures depend on the compiler: one of
another version, and a build of another kind, are skipped.
"""

import json
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
BUDGET = ROOT / "tests" / "size_budget.json"
LIBRARIES = ("libfcl_fibers_tree.so", "libfcl_fibers.so", "libfcl_fibers_io.so")
ABOUT = "A commit that changes this by tests/size_test.py --write says why."
TOLERANCE = 0.02
FEWEST = 10  # instantiations of a template that counts
TEMPLATE = re.compile(
    r"fcl_fibers::tree::(?:N_\w+::)?(?:internal::|\(anonymous namespace\)::)*(\w+)<"
)
SKIPPED = 77


def output(*command):
    done = subprocess.run(command, stdout=subprocess.PIPE, check=True, encoding="utf-8")
    return done.stdout


def made_by(library):
    """What the figures of a library depend on: the compiler, the machine and the kind of build."""
    if library.suffix == ".a":
        return "static linking"
    if not library.exists():
        raise SystemExit(f"{library} is not there; build the libraries of the preset release")
    comment = output("readelf", "--string-dump=.comment", library)
    compiler = " and ".join(sorted(set(re.findall(r"\] +(\S.*?)\s*$", comment, re.MULTILINE))))
    # Corrections of a distribution's compiler do not change its version.
    compiler = re.sub(r"\+deb\w+", "", compiler)
    machine = re.search(r"Machine: +(.*)", output("readelf", "--file-header", library))[1]
    cache = (library.parents[1] / "CMakeCache.txt").read_text(encoding="utf-8")
    build, flags = (
        (re.search(rf"^{name}:\w+=(.*)$", cache, re.MULTILINE) or ("", "of several kinds"))[1]
        for name in ("CMAKE_BUILD_TYPE", "CMAKE_CXX_FLAGS")
    )
    flags = "".join(f" {flag}" for flag in flags.split() if not flag.startswith("-W"))
    return f"{compiler}, {machine}, {build}{flags}"


def instantiation(symbol):
    """The name of a template of src/tree and the instantiation of it that a symbol belongs to."""
    if (match := TEMPLATE.search(symbol)) is None:
        return None
    depth, end = 1, match.end()
    while depth > 0 and end < len(symbol):
        depth += {"<": 1, ">": -1}.get(symbol[end], 0)
        end += 1
    return match[1], symbol[match.start() : end]


def figures(library):
    symbols = output("nm", "--demangle", "--defined-only", library).splitlines()
    if not symbols:
        raise SystemExit(f"{library} has no symbols; build it without stripping it")
    found = {instantiation(symbol) for symbol in symbols} - {None}
    counts = Counter(name for name, _ in found)
    return {
        "text": int(output("size", library).splitlines()[1].split()[0]),
        "instantiations": {
            name: count for name, count in sorted(counts.items()) if count >= FEWEST
        },
    }


def differences(name, budget, now):
    rows = {"bytes of text": (budget["text"], now["text"])}
    for template in sorted(budget["instantiations"] | now["instantiations"]):
        rows[f"instantiations of {template}"] = tuple(
            side["instantiations"].get(template, 0) for side in (budget, now)
        )
    for what, (allowed, count) in rows.items():
        if abs(count - allowed) > TOLERANCE * allowed:
            yield f"{name}: {count:,} {what}, and {allowed:,} in the budget"


def main():
    arguments = sys.argv[1:]
    if arguments == ["--write"]:
        paths = [ROOT / "build" / "release" / "src" / name for name in LIBRARIES]
        budget = {
            "about": ABOUT,
            "made by": made_by(paths[0]),
            "libraries": {path.name: figures(path) for path in paths},
        }
        BUDGET.write_text(json.dumps(budget, indent=2) + "\n", encoding="utf-8")
        return 0
    paths = [Path(argument) for argument in arguments]
    paths = paths or [ROOT / "build" / "release" / "src" / name for name in LIBRARIES]
    budget = json.loads(BUDGET.read_text(encoding="utf-8"))
    errors = []
    for path in paths:
        if (kind := made_by(path)) != budget["made by"]:
            print(f"{path.name} is made by {kind}; the budget is for {budget['made by']}")
            return SKIPPED
        name = f"{path.name.partition('.so')[0]}.so"
        errors += differences(name, budget["libraries"][name], figures(path))
    if errors:
        print("\n".join(errors))
        print("If this is meant, run tests/size_test.py --write, and say why in the commit.")
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
