"""What the states of self-stress of droplets at onset consist of, against N. pytest -m benchmark -s.

JAMLAB_SEEDS sets how many packings of N = 16 (60; of larger ones fewer, `SHARE`), the first of the reference data made
again; JAMLAB_RESULTS a folder where packings are kept, so that a run can go on where it was stopped. Eight CPU minutes.
`docs/explanation/beyond_the_papers.md` repeats what it prints.
"""

import os
from pathlib import Path

import numpy as np
import pytest
from self_stress import self_stress

import jamlab
from jamlab.figures.papers.reference_data import reference_tables

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
    """S = forces + rings + contacts that coincide; forces but for few are one, which loads every droplet."""
    print("\n     N  packings  S as shipped  mean S  S = 1  forces = 1  rings  coinciding  rest 0  unloaded contacts")
    for n, share in SHARE.items():
        reference, packings = shipped(n), range(1, max(round(share * SEEDS), 1) + 1)
        packings = [seed for seed in packings if seed in reference]  # no onset of the others
        found = [self_stress(onset(folder, n, seed)) for seed in packings]
        states, rings = np.array([f.states for f in found]), [len(f.rings) for f in found]
        coinciding, forces = [f.coinciding for f in found], np.array([f.forces for f in found])
        rest = states - forces - rings - np.array(coinciding)
        unloaded = [f.contacts - f.loaded for f in found]
        print(
            f"{n:6d} {len(found):9d} {(states == reference[packings]).sum():13d} {states.mean():7.2f} "
            f"{(states == 1).sum():6d} {(forces == 1).sum():11d} {sum(rings):6d} {sum(coinciding):11d} "
            f"{(rest == 0).sum():7d}  {sum(unloaded)} of {sum(f.contacts for f in found)}, at most {max(unloaded)}"
        )
        print(f"        droplets of a ring: {sorted(length for f in found for length in f.rings)}")
        for seed in np.array(packings)[forces != 1]:
            print(f"        seed {seed}: {found[packings.index(seed)]}")
        assert all(f.spanned == f.droplets and not f.pushing_couples for f in found)
        assert (rest == 0).all()
        assert (forces == 1).mean() > 0.9
