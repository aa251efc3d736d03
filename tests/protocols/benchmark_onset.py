"""Onset of jamming of disks in larger steps against the paper's own protocol. pytest -m benchmark -s.

JAMLAB_SEEDS sets how many seeds (200), JAMLAB_RESULTS a folder where each result is kept as it comes, so that a run can
go on where it was stopped. Onsets against N: `jamlab study run boromand-10`.
"""

import json
import os
import time

import numpy as np
import pytest
from kept_results import kept_rows
from scipy.stats import ks_2samp

import jamlab

SEEDS = int(os.environ.get("JAMLAB_SEEDS", "200"))


def onset(n, seed, search):
    """phi_J and seconds, or the error."""
    began = time.perf_counter()
    try:
        row = {"phi": jamlab.jam("sp", n, seed, search=search).phi}
    except jamlab.ConvergenceError as error:
        row = {"error": str(error)}
    return row | {"t": time.perf_counter() - began}


@pytest.mark.benchmark
def test_larger_steps_give_the_distribution_of_the_paper(kept_folder):
    """Bisection with steps of 1e-2 against 1e-4 all the way, N = 32: Kolmogorov-Smirnov."""
    keys = {search: [(32, seed, search) for seed in range(1, SEEDS + 1)] for search in ("bisection", "paper")}
    names = ("n", "seed", "search")
    fast, slow = (kept_rows(kept_folder / f"onset-{s}.jsonl", names, each, onset) for s, each in keys.items())
    a, b = (np.array([row["phi"] for row in rows if "phi" in row]) for rows in (fast, slow))
    test = ks_2samp(a, b)
    result = {"bisection": [float(a.mean()), float(a.std(ddof=1))], "paper": [float(b.mean()), float(b.std(ddof=1))]}
    result |= {"seeds": [len(a), len(b)], "ks": float(test.statistic), "p": float(test.pvalue)}
    result |= {"ratio_of_time": float(np.median([r["t"] for r in slow]) / np.median([r["t"] for r in fast]))}
    print("\n" + json.dumps(result))
    assert test.pvalue > 0.05
