#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Whether every promise of docs/contract.md and docs/numerics.md has the tests that contract.txt
names, every test that these pages, docs/crossings.md and tests/README.md name is there, and the
rows of docs/numerics are those that are tested:

    tests/contract_names.py NUMERICS_TEST     # the executable
"""

import csv
import re
import subprocess
import sys
from pathlib import Path

TESTS = Path(__file__).resolve().parent
DOCS = TESTS.parent / "docs"
PAGES = {
    name: (DOCS / name).read_text(encoding="utf-8")
    for name in ("contract.md", "crossings.md", "numerics.md", "../tests/README.md")
}
CODE = {
    suffix: "\n".join(path.read_text(encoding="utf-8") for path in TESTS.rglob(f"*{suffix}"))
    for suffix in ("_test.cpp", ".py")
}
IN_CPP = re.compile(r"^(?:TYPED_)?TEST(?:_F|_P)?\((\w+), (\w+)\)", re.MULTILINE)
SUITES = {}
for suite, name in IN_CPP.findall(CODE["_test.cpp"]):
    SUITES.setdefault(suite, set()).add(name)


def is_test(name):
    """Of SUITE, SUITE.*, SUITE.NAME, or the path of a script and a function of it."""
    if ":" in name:
        script, _, function = name.partition(":")
        path = TESTS.parent / script
        return path.is_file() and f"\n{function}() {{" in path.read_text(encoding="utf-8")
    suite, _, test = name.partition(".")
    return suite in SUITES and (test in ("", "*") or test in SUITES[suite])


def section(page, heading):
    return re.search(rf"^## {heading}\n(.*?)^## ", PAGES[page], re.MULTILINE | re.DOTALL)[1]


def first_cells(text):
    """Of tables, except for headings, which are bold or stand above a line of dashes."""
    rows = re.findall(r"^\| (.*?) \|.*\n(\|-)?", text, re.MULTILINE)
    return [cell for cell, dashes in rows if not dashes and not cell.startswith("**")]


def promises():
    return {
        "contract.md": first_cells(section("contract.md", "Call by call")),
        "numerics.md": first_cells(section("numerics.md", "Other extremes"))
        + re.findall(
            r"^\* \*\*(.*?)\*\*", section("numerics.md", "What is promised"), re.MULTILINE
        ),
    }


def wrong_promises():
    listed = {page: [] for page in promises()}
    blocks = (TESTS / "contract.txt").read_text(encoding="utf-8").split("\n\n")[1:]
    for block in blocks:
        heading, *lines = block.splitlines()
        page, _, promise = heading.partition(": ")
        listed[page].append(promise)
        tests = " ".join(lines).split()
        if not tests:
            yield f"tests/contract.txt: '{heading}' has no test"
        for name in tests:
            if not is_test(name):
                yield f"tests/contract.txt: {name} of '{heading}' is no test"
    for page, expected in promises().items():
        if len(expected) < 10:
            yield f"docs/{page}: its promises were not found"
        for promise in set(expected + listed[page]):
            if (expected.count(promise), listed[page].count(promise)) != (1, 1):
                yield f"'{promise}' has to stand once in docs/{page} and once in tests/contract.txt"


def wrong_names():
    """Tests that the pages name."""
    for page, text in PAGES.items():
        codes = " ".join(re.findall(r"`([^`]+)`", text))
        for name in set(re.findall(r"\b[A-Z]\w+\.(?:[A-Z]\w+|\*)", codes)):
            if not is_test(name):
                yield f"docs/{page} names {name}, which is no test"
        for name in set(re.findall(r"\btest_\w+", codes)):
            if f"def {name}(" not in CODE[".py"]:
                yield f"docs/{page} names {name}, which is no test"


def wrong_rows(numerics_test):
    for scalar in ("Float", "Double"):
        tested = subprocess.run(
            [numerics_test, "--gtest_list_tests", f"--gtest_filter=Rows/ExtremeTest.{scalar}/*"],
            stdout=subprocess.PIPE,
            text=True,
            check=True,
        ).stdout
        names = sorted(re.findall(rf"^  {scalar}/(\w+)", tested, re.MULTILINE))
        if not names:
            yield f"Rows/ExtremeTest.{scalar} has no rows"
        for table in ("rows.csv", "times.csv"):
            lines = csv.DictReader((DOCS / "numerics" / table).open(encoding="utf-8"))
            rows = sorted(line["row"] for line in lines if line["scalar"] == scalar.lower())
            if rows != names:
                yield f"docs/numerics/{table} has other rows than Rows/ExtremeTest.{scalar}"


def wrong_extremes():
    """The table of the worst rows, which names the beginnings of their names."""
    columns = {}
    for table, column in (("rows", "false_capsules"), ("times", "query")):
        lines = csv.DictReader((DOCS / f"numerics/{table}.csv").open(encoding="utf-8"))
        columns[column] = [(line["row"], float(line[column])) for line in lines]
    covered = set()
    for line in re.findall(r"^\|.*`.*\|$", section("numerics.md", "Rows"), re.MULTILINE):
        begins = tuple(re.findall(r"`(\w+)`", line))
        shown = [float(cell) for cell in line.strip("|").split("|")[2:]]
        of_kind = [[v for row, v in c if row.startswith(begins)] for c in columns.values()]
        covered |= {row for row, _ in columns["query"] if row.startswith(begins)}
        if shown != [max(values, default=None) for values in of_kind]:
            yield f"docs/numerics.md: the worst rows are other ones than in {line}"
    for row in {row for row, _ in columns["query"]} - covered:
        yield f"docs/numerics.md: {row} is in no row of the table of the worst"


def main():
    wrong = [*wrong_promises(), *wrong_names(), *wrong_rows(sys.argv[1]), *wrong_extremes()]
    sys.exit("\n".join(wrong) or 0)


if __name__ == "__main__":
    main()
