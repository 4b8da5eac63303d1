#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Names the tests that were skipped, and why, as `ctest --output-junit FILE` tells them:

    tests/skipped_tests.py FILE

Tests that are DISABLED are not named; the long run has them by itself.
"""
import re
import sys
import xml.etree.ElementTree as ElementTree

for test in ElementTree.parse(sys.argv[1]).getroot().iter("testcase"):
    if test.find("skipped") is not None:
        output = test.findtext("system-out", "").strip()
        by_google_test = re.search(r": Skipped\n(.+)", output)
        reason = by_google_test[1] if by_google_test else output.rpartition("\n")[2]
        name = test.get("name").partition("  #")[0]
        print(f"{name}: {reason}")
