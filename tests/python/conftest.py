# SPDX-License-Identifier: BSD-3-Clause
"""Settings of all tests. FCL_FIBERS_LONG=1 tries many more random cases."""

import os
import tempfile

import hypothesis
import hypothesis.configuration

LONG = os.environ.get("FCL_FIBERS_LONG") == "1"

# What hypothesis keeps about Unicode is for no repository.
hypothesis.configuration.set_hypothesis_home_dir(
    os.path.join(tempfile.gettempdir(), "fcl_fibers_hypothesis")
)
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
