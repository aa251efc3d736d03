"""Onsets of jamming from other starts and in other steps: one distribution. pytest -m benchmark -s.

JAMLAB_SEEDS sets how many seeds (40), JAMLAB_RESULTS a folder where each result is kept as it comes, so that a run can
go on where it was stopped. Onsets against N: `python -m studies draw boromand-10`; cost: size-scaling.
"""

import json
import os
import time

import numpy as np
import pytest
from kept_results import kept_rows
from scipy.stats import ks_2samp

import jamlab
from jamlab.protocols import descent

SEEDS = int(os.environ.get("JAMLAB_SEEDS", "40"))


def onset(model, n, seed, option, value):
    """rho_J and CPU seconds, or the error."""
    descent.QUENCH = descent.Quench(many_disks=10**9) if value == "cg" else descent.Quench()
    how = {} if option == "minimiser" else {option: value}
    began = time.process_time()
    try:
        packing = jamlab.jam(n, model, seed, **how)
        row = {"rho": packing.phi_J, "phi": packing.phi}
    except jamlab.ConvergenceError as error:
        row = {"error": str(error)}
    return row | {"t": time.process_time() - began}


@pytest.mark.benchmark
@pytest.mark.parametrize(
    ("model", "n", "option", "values"),
    [
        ("sp", 32, "search", ("bisection", "incremental")),
        ("dp", 16, "start", ("from-disks", "direct")),
        ("sp", 256, "minimiser", ("fire", "cg")),
    ],
    ids=[
        "disks in steps of 1e-2 or 1e-4 all the way",
        "droplets carried by disks or compressed from phi = 0.20",
        "disks by compiled FIRE or by conjugate gradients of LAMMPS",
    ],
)
def test_onsets_have_one_distribution(kept_folder, model, n, option, values):
    """Two samples, Kolmogorov-Smirnov; the first way is the default."""
    names = ("model", "n", "seed", "option", "value")
    keys = {value: [(model, n, seed, option, value) for seed in range(1, SEEDS + 1)] for value in values}
    fast, slow = (kept_rows(kept_folder / f"onset-{v}.jsonl", names, each, onset) for v, each in keys.items())
    a, b = (np.array([row["rho"] for row in rows if "rho" in row]) for rows in (fast, slow))
    test = ks_2samp(a, b)
    result = {
        value: [float(rho.mean()), float(rho.std(ddof=1)), len(rho)] for value, rho in zip(values, (a, b), strict=True)
    }
    result |= {"ks": float(test.statistic), "p": float(test.pvalue)}
    result |= {"ratio_of_time": float(np.median([r["t"] for r in slow]) / np.median([r["t"] for r in fast]))}
    print("\n" + json.dumps(result))
    assert test.pvalue > 0.05
