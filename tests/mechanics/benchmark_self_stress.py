"""What the states of self-stress of droplets at onset consist of, against N. pytest -m benchmark -s.

JAMLAB_SEEDS sets how many packings of N = 16 (60; of larger ones fewer, `SHARE`), the first of the reference data made
again; JAMLAB_RESULTS a folder where packings are kept, so that a run can go on where it was stopped. Nine CPU minutes.
`docs/explanation/beyond_the_papers.md` repeats what it prints, which is checked where packings are those of the data.
"""

import os
from pathlib import Path

import numpy as np
import pytest
from self_stress import self_stress

import jamlab
from studies.reference_data import reference_tables

PAGE = Path(__file__).parents[2] / "docs" / "explanation" / "beyond_the_papers.md"
SEEDS = int(os.environ.get("JAMLAB_SEEDS", "60"))
SHARE = {16: 1.0, 32: 2 / 3, 64: 0.4, 128: 0.1}  # of the seeds: time grows as N^1.5


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    given = os.environ.get("JAMLAB_RESULTS")
    path = Path(given) if given else tmp_path_factory.mktemp("self-stress")
    path.mkdir(parents=True, exist_ok=True)
    return path


def onset(folder, n, seed):
    file = folder / f"dp_{n}_{seed}.h5"
    if not file.exists():
        jamlab.jam("dp", n, seed).write(file)
    return jamlab.read(file)


def shipped(n):
    """S of the reference data by seed."""
    table = reference_tables().onset
    return table[(table["model"] == "dp") & (table["n"] == n)].set_index("seed")["self_stresses"]


@pytest.mark.benchmark
def test_one_state_of_forces_and_couples_of_rings_and_contacts_that_coincide(folder):
    """S = forces + rings + contacts that coincide; forces but for few are one, which loads all droplets but few."""
    print(
        "\n| N | packings | S = 1 | one state of forces | mean of S | rings | contacts that coincide | without load |"
    )
    for n, share in SHARE.items():
        reference, packings = shipped(n), range(1, max(round(share * SEEDS), 1) + 1)
        packings = [seed for seed in packings if seed in reference]  # no onset of the others
        found = [self_stress(onset(folder, n, seed)) for seed in packings]
        states, rings = np.array([f.states for f in found]), np.array([len(f.rings) for f in found])
        coinciding, forces = np.array([f.coinciding for f in found]), np.array([f.forces for f in found])
        whole = [f.spanned == f.droplets for f in found]
        same = (states == reference[packings]).all()
        loose, contacts = sum(f.contacts - f.loaded for f in found), sum(f.contacts for f in found)
        row = (
            f"| {n} | {len(found)} | {(states == 1).sum()} | {(forces == 1).sum()} | {states.mean():.2f} "
            f"| {rings.sum()} | {coinciding.sum()} | {loose} of {contacts} |"
        )
        print(row, "" if same else "  other packings than those of the reference data")
        print(f"    droplets of a ring: {sorted(length for f in found for length in f.rings)}")
        for seed, f in zip(packings, found, strict=True):
            if f.forces != 1 or f.spanned != f.droplets:
                print(f"    seed {seed}: {f}")
        assert (states == forces + rings + coinciding).all()
        assert not any(f.pushing_couples for f in found)
        assert all(f.spanned >= f.droplets - 1 for f in found)
        assert min((forces == 1).mean(), np.mean(whole)) > 0.9
        assert row in PAGE.read_text() or SEEDS != 60 or not same
