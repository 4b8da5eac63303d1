#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Counts the tests that passed, failed and were skipped, and says why they were skipped:

    tests/count_tests.py FOLDER [--skipped]     only those that were skipped, one a line

FOLDER has a file of `ctest --output-junit`, ctest.xml, and one of GoogleTest's for each executable,
whose tests count instead of it. Tests that are DISABLED are not counted; the long run has them.
"""
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path


def reason_of(test, skipped):
    """Behind the place in GoogleTest's message; for ctest, what the test has printed last."""
    by_google_test = skipped.get("message", "").partition("\n")[2]
    printed = test.findtext("system-out", "").strip().rpartition("\n")[2]
    return by_google_test.strip() or printed


def read(folder):
    """(passed, failed, skipped with the reasons)"""
    passed, failed, skipped = 0, 0, []
    files = sorted(Path(folder).glob("*.xml"))
    names = {file.stem for file in files}
    for file in files:
        for test in ElementTree.parse(file).getroot().iter("testcase"):
            of_ctest = file.stem == "ctest"
            name = test.get("name").partition("  #")[0]
            if of_ctest:
                if name in names:
                    continue
            elif test.get("status") == "notrun":
                continue
            else:
                name = f"{test.get('classname')}.{name}"
            reason = test.find("skipped")
            if reason is not None:
                skipped.append(f"{name}: {reason_of(test, reason)}")
            elif test.find("failure") is not None:
                failed += 1
            else:
                passed += 1
    return passed, failed, skipped


def main():
    passed, failed, skipped = read(sys.argv[1])
    for line in skipped:
        print(line if "--skipped" in sys.argv else f"skipped: {line}")
    if "--skipped" not in sys.argv:
        print(f"{passed} passed, {failed} failed, {len(skipped)} skipped")


if __name__ == "__main__":
    main()
