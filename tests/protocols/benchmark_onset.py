"""Onset of jamming of disks: phi_J against N, and against the paper's own protocol. pytest -m benchmark -s.

JAMLAB_SEEDS sets how many seeds (200), JAMLAB_RESULTS a folder where each result is kept as it comes, so that a run can
go on where it was stopped. Prints tables and one JSON object each.
"""

import json
import os
import time
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import ks_2samp

import jamlab
from jamlab.statistics.bootstrap import bootstrap
from jamlab.statistics.published_numbers import ONSET_LIMIT, THETA

SEEDS = int(os.environ.get("JAMLAB_SEEDS", "200"))
SIZES = (32, 64, 128, 256)
RESAMPLES = 2000


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    given = os.environ.get("JAMLAB_RESULTS")
    path = Path(given) if given else tmp_path_factory.mktemp("onset")
    path.mkdir(parents=True, exist_ok=True)
    return path


def onsets(folder, n, search):
    """One row per seed: phi_J, seconds, whether isostatic, or the error."""
    file = folder / f"onset-{search}-{n}.jsonl"
    known = {row["seed"]: row for row in map(json.loads, file.read_text().splitlines())} if file.exists() else {}
    with file.open("a") as out:
        for seed in range(1, SEEDS + 1):
            if seed in known:
                continue
            began = time.perf_counter()
            row = {"seed": seed}
            try:
                p = jamlab.jam("sp", n, seed, search=search)
                c = jamlab.contacts(p)
                row |= {"phi": p.phi, "z": c.z, "iso": c.count == c.isostatic}
            except jamlab.ConvergenceError as error:
                row |= {"error": str(error)}
            row["t"] = time.perf_counter() - began
            out.write(json.dumps(row) + "\n")
            out.flush()
            known[seed] = row
    return [known[seed] for seed in range(1, SEEDS + 1)]


@pytest.mark.benchmark
def test_onset_against_size(folder):
    """sigma ~ N^-theta, beside theta = 0.55; phi_J extrapolated with that exponent, beside 0.842 ([B] fig 10)."""
    found = {n: onsets(folder, n, "bisection") for n in SIZES}
    phi = {n: np.array([row["phi"] for row in rows if "phi" in row]) for n, rows in found.items()}
    print("\n     N  seeds  failed  isostatic  <phi_J>    sigma    median s")
    for n, rows in found.items():
        good = [row for row in rows if "phi" in row]
        seconds = np.median([row["t"] for row in rows])
        isostatic = sum(row["iso"] for row in good)
        print(
            f"{n:6d} {len(rows):6d} {len(rows) - len(good):7d} {isostatic:10d} {phi[n].mean():9.5f} "
            f"{phi[n].std(ddof=1):8.5f} {seconds:9.3f}"
        )

    def theta_and_limit(groups):
        theta = -np.polyfit(np.log(SIZES), np.log([g.std(ddof=1) for g in groups]), 1)[0]
        return theta, np.polyfit(np.array(SIZES) ** -theta, [g.mean() for g in groups], 1)[1]

    found = bootstrap(list(phi.values()), theta_and_limit, resamples=RESAMPLES)
    result = {"theta": found.value[0], "theta_95": [found.low[0], found.high[0]], "theta_paper": THETA.value}
    result |= {"phi_limit": found.value[1], "phi_limit_95": [found.low[1], found.high[1]]}
    result |= {"phi_limit_paper": ONSET_LIMIT.value}
    print(json.dumps(result))
    assert all(len(values) >= 0.98 * SEEDS for values in phi.values())


@pytest.mark.benchmark
def test_larger_steps_give_the_distribution_of_the_paper(folder):
    """Bisection with steps of 1e-2 against 1e-4 all the way, N = 32: Kolmogorov-Smirnov."""
    fast, slow = (onsets(folder, 32, search) for search in ("bisection", "paper"))
    a, b = (np.array([row["phi"] for row in rows if "phi" in row]) for rows in (fast, slow))
    test = ks_2samp(a, b)
    result = {"bisection": [float(a.mean()), float(a.std(ddof=1))], "paper": [float(b.mean()), float(b.std(ddof=1))]}
    result |= {"seeds": [len(a), len(b)], "ks": float(test.statistic), "p": float(test.pvalue)}
    result |= {"ratio_of_time": float(np.median([r["t"] for r in slow]) / np.median([r["t"] for r in fast]))}
    print("\n" + json.dumps(result))
    assert test.pvalue > 0.05
