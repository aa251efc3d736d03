"""The study of droplets near onset, on curves of known laws and on one small packing."""

import numpy as np
import pandas as pd
import pytest

import jamlab
from studies.beyond import droplet_approach
from studies.beyond.droplet_approach import PLACES, STUDY, curves, error, from_own_onset, statistics
from studies.ensembles import bootstrap

STRONG = {"root": (2.5, 6.0), "linear": (0.0, 20.0)}


def of_law(root, linear, packings=60):
    """Curves of packings whose mean is root x^1/2 + linear x, with scatter of each packing and of each place."""
    rng = np.random.default_rng(1)
    mean = root * PLACES**0.5 + linear * PLACES
    return mean * (1 + 0.2 * rng.normal(size=(packings, 1)) + 0.1 * rng.normal(size=(packings, len(PLACES))))


@pytest.mark.parametrize("law", STRONG)
def test_the_law_of_synthetic_packings_is_told(law):
    """Exponents and coefficients within three errors, and the other law excluded."""
    found = bootstrap([of_law(*STRONG[law])], lambda drawn: statistics(drawn[0]))
    near, far, root, linear = (type(found)(*ends) for ends in list(zip(*vars(found).values(), strict=True))[:4])
    for got, wanted in zip((root, linear), STRONG[law], strict=True):
        assert abs(got.value - wanted) < 3 * error(got)
    chi_2 = dict(zip(droplet_approach.LAWS, found.value[4:], strict=True))
    if law == "linear":
        assert abs(1 - near.value) < 3 * error(near) and abs(1 - far.value) < 3 * error(far)
        assert chi_2["linear"] < 30
    else:
        assert (1 - near.value) / error(near) > 5 and root.value / error(root) > 5
        assert chi_2["linear"] > 100 * chi_2["root + linear"] / 7


def test_packings_are_taken_from_their_own_onset_and_only_whole():
    distances = [0.0, 1e-3, 5e-3, 0.03]
    one = {"n": 8, "vertices": 12, "d_rho": distances, "g": 1.0}
    whole = pd.DataFrame(one | {"seed": 1, "z": [4.0, 4.1, 4.2, 4.5], "z_strong": [3.9, 4.1, 4.2, 4.5]})
    broken_off = whole.iloc[:3].assign(seed=2)
    rows = from_own_onset(pd.concat([whole, broken_off]))
    assert rows.loc[rows["seed"] == 1, "d_z"].tolist() == pytest.approx([0.1, 0.2, 0.5])
    assert rows.loc[rows["seed"] == 1, "d_z_strong"].tolist() == pytest.approx([0.2, 0.3, 0.6])
    (found,) = curves(rows, "d_z")  # the other ends before the last place
    assert found[0] == pytest.approx(0.1, abs=5e-3) and found[-1] < 0.5


def test_rows_are_those_of_a_sweep(monkeypatch):
    monkeypatch.setattr(droplet_approach, "PER_DECADE", 1)
    onset, *rest = droplet_approach.measure_approach(8, 12, 2)
    packing = jamlab.jam(8, "dp", 2, start="from-disks")
    assert onset["d_rho"] == 0 and onset["z"] == jamlab.contacts(packing).z
    assert [row["d_rho"] for row in rest] == pytest.approx([1e-3, 1e-2, 0.03], rel=0.01)
    assert all(row["g"] == pytest.approx(row["g"]) for row in rest)


def test_each_kind_has_its_packings():
    assert len(STUDY.tasks) == sum(droplet_approach.PACKINGS.values())
