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


def read(folder):
    """(passed, failed, skipped with the reasons)"""
    passed, failed, skipped = 0, 0, []
    failed_of = {}  # by executable
    for file in Path(folder).glob("*_test*.xml"):
        failed_of[file.stem] = 0
        for test in ElementTree.parse(file).getroot().iter("testcase"):
            if (why := test.find("skipped")) is not None:
                # The first line is the place.
                reason = why.get("message").partition("\n")[2].strip()
                skipped.append(f"{test.get('classname')}.{test.get('name')}: {reason}")
            elif test.find("failure") is not None:
                failed_of[file.stem] += 1
            elif test.get("status") == "run":
                passed += 1

    for test in ElementTree.parse(Path(folder) / "ctest.xml").getroot().iter("testcase"):
        name = test.get("name")
        if test.get("status") == "run":
            passed += name not in failed_of
        elif "SKIP_RETURN_CODE" in ElementTree.tostring(test, "unicode"):
            printed = test.findtext("system-out", "").strip()
            skipped.append(f"{name}: {printed.rpartition(chr(10))[2]}")
        else:  # A sanitizer may complain after the last test has passed.
            failed += failed_of.get(name) or 1
    return passed, failed, skipped


def main():
    passed, failed, skipped = read(sys.argv[1])
    for line in skipped:
        print(line if "--skipped" in sys.argv else f"skipped: {line}")
    if "--skipped" not in sys.argv:
        print(f"{passed} passed, {failed} failed, {len(skipped)} skipped")


if __name__ == "__main__":
    main()
