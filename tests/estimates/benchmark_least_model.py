"""The automatic choice against default droplets, and against droplets all the way. pytest -m benchmark -s.

JAMLAB_SEEDS sets how many packings (50), JAMLAB_RESULTS a folder where each result is kept as it comes, so that a run
can go on where it was stopped. Prints one JSON object.
"""

import json
import os
import time
from pathlib import Path

import pytest

import jamlab
from jamlab.estimates.ensemble_way import bring_on, default_way, value_at
from jamlab.studies.least_model.estimate_table import SEEDS as TABLE_SEEDS

COUNT = int(os.environ.get("JAMLAB_SEEDS", "50"))
N = 64
LEVELS = (0.86, 0.87, 0.88)
LOOSE, TIGHT = {"z": 0.25}, {"z": 0.05}
ALWAYS = 3  # packings made as droplets all the way: they take minutes each


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    given = os.environ.get("JAMLAB_RESULTS")
    path = Path(given) if given else tmp_path_factory.mktemp("least-model")
    path.mkdir(parents=True, exist_ok=True)
    return path


def kept(file, seeds, run):
    """One row per seed, from the file or by running."""
    known = {row["seed"]: row for row in map(json.loads, file.read_text().splitlines())} if file.exists() else {}
    with file.open("a") as out:
        for seed in seeds:
            if seed not in known:
                known[seed] = {"seed": seed} | run(seed)
                out.write(json.dumps(known[seed]) + "\n")
                out.flush()
    return [known[seed] for seed in seeds]


def by_choice(seed):
    rho = LEVELS[seed % len(LEVELS)]
    try:
        row = {"rho": rho}
        for name, tolerance in (("loose", LOOSE), ("tight", TIGHT)):
            found = jamlab.scene(rho, N, seed, tolerance=tolerance)
            row |= {f"{name}_way": str(found.choice.way), f"{name}_seconds": found.seconds}
            row |= {f"{name}_z": found.estimate["z"], f"{name}_expected": found.choice.error["z"]}
        began = time.perf_counter()
        row["z"] = value_at(bring_on(default_way(N), jamlab.jam("sp", N, seed), rho), "z")
        return row | {"seconds": time.perf_counter() - began}
    except jamlab.ConvergenceError as error:
        return {"rho": rho, "error": str(error)}


def droplets_all_the_way(seed):
    rho = LEVELS[seed % len(LEVELS)]
    began = time.perf_counter()
    try:
        *_, last = jamlab.compress(jamlab.jam("dp", N, seed), rho, 0.02)
    except jamlab.ConvergenceError as error:
        return {"rho": rho, "error": str(error), "seconds": time.perf_counter() - began}
    return {"rho": rho, "z": jamlab.contacts(last).z, "seconds": time.perf_counter() - began}


@pytest.mark.benchmark
def test_choice_meets_its_tolerance_and_saves_time(folder):
    """z within 0.25 by disks in 95 % of packings that the table was not made from; z within 0.05 five times faster.

    At N = 64 nothing but droplets themselves keeps z within 0.05: there the saving is that disks carry them.
    """
    seeds = range(1, COUNT + 1)
    assert not set(seeds) & set(TABLE_SEEDS)
    rows = kept(folder / "least-model.jsonl", seeds, by_choice)
    slow = kept(folder / "always-dp.jsonl", range(1, ALWAYS + 1), droplets_all_the_way)
    good = [row for row in rows if "z" in row]
    result = {"packings": len(good), "refused": len(rows) - len(good)}
    for name, limit in (("loose", LOOSE["z"]), ("tight", TIGHT["z"])):
        off = [abs(row[f"{name}_z"] - row["z"]) for row in good]
        ways = [row[f"{name}_way"] for row in good]
        result[name] = {
            "limit": limit,
            "share": sum(e <= limit for e in off) / len(off),
            "largest": max(off),
            "ways": {way: ways.count(way) for way in sorted(set(ways))},
        }
        paired = [(s["seconds"], r[f"{name}_seconds"]) for s, r in zip(slow, rows, strict=False) if "z" in r]
        result[name]["always_dp_over_auto"] = sum(s for s, _ in paired) / sum(a for _, a in paired)
    print("\n" + json.dumps(result))
    assert all(result[name]["share"] >= 0.95 for name in ("loose", "tight"))
    assert result["tight"]["always_dp_over_auto"] >= 5
