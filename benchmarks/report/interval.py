# SPDX-License-Identifier: BSD-3-Clause
"""What samples allow to say of their medians."""

import numpy as np

DRAWS = 2000
LEVEL = 0.95


def of_median(sample):
    """The 95 % bootstrap interval of a median."""
    values = np.asarray(sample, float)
    drawn = np.random.default_rng(1).choice(values, (DRAWS, len(values)))
    rest = (1 - LEVEL) / 2
    return tuple(np.quantile(np.median(drawn, axis=1), (rest, 1 - rest)))
