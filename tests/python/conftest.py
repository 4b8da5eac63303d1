# SPDX-License-Identifier: BSD-3-Clause
"""Settings of all tests. FCL_FIBERS_LONG=1 tries many more random cases."""

import os

import hypothesis

LONG = os.environ.get("FCL_FIBERS_LONG") == "1"

# The same cases at each run, and no time limit for one of them, as the machine may be busy.
hypothesis.settings.register_profile(
    "tests",
    max_examples=3000 if LONG else 60,
    derandomize=not LONG,
    database=None,
    deadline=None,
    suppress_health_check=list(hypothesis.HealthCheck),
)
hypothesis.settings.load_profile("tests")
