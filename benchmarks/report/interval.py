# SPDX-License-Identifier: BSD-3-Clause
"""What samples allow to say of their medians."""

import numpy as np
import pandas as pd

DRAWS = 2000
LEVEL = 0.95


def of_median(sample):
    """The 95 % bootstrap interval of a median. Of a sample by process, processes are drawn first,
    and then runs of each: two processes differ more than two runs of one."""
    random, rest = np.random.default_rng(1), (1 - LEVEL) / 2
    of_process = [np.asarray(runs, float) for runs in by_process(sample).values()]
    if len(of_process) == 1:
        medians = np.median(random.choice(of_process[0], (DRAWS, len(of_process[0]))), axis=1)
    else:
        medians = []
        for _ in range(DRAWS):
            drawn = random.integers(len(of_process), size=len(of_process))
            runs = [random.choice(of_process[i], len(of_process[i])) for i in drawn]
            medians.append(np.median(np.concatenate(runs)))
    return tuple(np.quantile(medians, (rest, 1 - rest)))


def by_process(sample):
    """The runs of each process by their ends; a sample that does not tell is of one."""
    if isinstance(sample, pd.Series) and sample.index.nlevels > 1:
        return {one: runs.droplevel(0) for one, runs in sample.groupby(level=0)}
    return {1: sample}
