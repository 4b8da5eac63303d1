# SPDX-License-Identifier: BSD-3-Clause
"""What samples allow to say of their medians."""

import numpy as np

DRAWS = 2000
LEVEL = 0.95


def drawn_medians(random, sample):
    """Medians of samples that are drawn from a sample, with replacement."""
    values = np.asarray(sample, float)
    return np.median(random.choice(values, (DRAWS, len(values))), axis=1)


def ends(drawn):
    """Of the interval that holds so many of what was drawn."""
    rest = (1 - LEVEL) / 2
    return tuple(np.quantile(drawn, (rest, 1 - rest)))


def of_ratio(theirs, ours):
    """The 95 % bootstrap interval of a ratio of two medians; of one median if `ours` is 1."""
    random = np.random.default_rng(1)
    return ends(drawn_medians(random, theirs) / drawn_medians(random, np.atleast_1d(ours)))
