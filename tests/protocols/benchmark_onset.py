"""Onsets of jamming in other steps and by another minimiser: one distribution. pytest -m benchmark -s.

JAMLAB_SEEDS sets how many seeds (40), JAMLAB_RESULTS a folder where each result is kept as it comes, so that a run can
go on where it was stopped. Onsets by start: `python -m studies draw onset-starts`; against N:
boromand-10; cost: size-scaling.
"""

import json
import os
import time

import numpy as np
import pytest
from kept_results import kept_rows
from scipy.stats import norm

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
        ("sp", 256, "minimiser", ("fire", "cg")),
    ],
    ids=[
        "disks in steps of 1e-2 or 1e-4 all the way",
        "disks by compiled FIRE or by conjugate gradients of LAMMPS",
    ],
)
def test_onsets_have_one_distribution(kept_folder, model, n, option, values):
    """Two samples of the same seeds; the first way is the default. Means differ by less than the bound of two one-sided
    tests at 5 %, which 40 seeds keep below three quarters of the width."""
    names = ("model", "n", "seed", "option", "value")
    keys = {value: [(model, n, seed, option, value) for seed in range(1, SEEDS + 1)] for value in values}
    fast, slow = (kept_rows(kept_folder / f"onset-{v}.jsonl", names, each, onset) for v, each in keys.items())
    a, b = (np.array([row["rho"] for row in rows if "rho" in row]) for rows in (fast, slow))
    error = np.hypot(a.std(ddof=1) / len(a) ** 0.5, b.std(ddof=1) / len(b) ** 0.5)
    bound = abs(a.mean() - b.mean()) + norm.ppf(0.95) * error
    result = {
        value: [float(rho.mean()), float(rho.std(ddof=1)), len(rho)] for value, rho in zip(values, (a, b), strict=True)
    }
    result |= {"bound": float(bound)}
    result |= {"ratio_of_time": float(np.median([r["t"] for r in slow]) / np.median([r["t"] for r in fast]))}
    print("\n" + json.dumps(result))
    assert bound < 0.75 * a.std(ddof=1)
