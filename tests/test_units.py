"""Natural units and back; that units change no function's physics is told by `tests/test_invariances.py`."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from invariant_cases import packings, scaled

import jamlab
from jamlab.packing.natural_units import Scales, natural_scales


@pytest.mark.parametrize("model", ["sp", "dp"])
@given(length=st.floats(-6, 6), stiffness=st.floats(-9, 9))
@settings(max_examples=10)
def test_natural_units_and_back_lose_no_digit(model, length, stiffness):
    """Of a packing in any units; in natural ones, sizes and stiffnesses lie within sqrt(2) of 1."""
    packing = scaled(packings()[model], 10.0**length, 10.0**stiffness)
    packing = packing.with_state(max_force=0.1, converged=True, rounding=0.3, force_tolerance=0.2)
    scales = natural_scales(packing)
    natural = scales.to_natural(packing)
    assert natural_scales(natural) == Scales()
    sizes = np.sqrt(natural.params["a0"]) if model == "dp" else natural.diameters
    assert 0.7 < sizes.mean() < 1.42 and 0.7 < natural.params["k" if model == "sp" else "eps"] < 1.42
    assert natural.rounding == 0.3 / scales.length
    assert (natural.force_tolerance, natural.max_force) == (0.2 / scales.force, 0.1 / scales.force)
    back = scales.from_natural(natural)
    assert packing.difference(back) is None and back.known == packing.known
    assert np.array_equal(back.positions, packing.positions) and np.array_equal(back.box, packing.box)


@pytest.mark.parametrize("units", [(1e-3, 1.0), (1.0, 1e4), (3e5, 1e-9)])
def test_a_session_refuses_units_in_which_skin_and_steps_of_lammps_mean_nothing(units):
    with pytest.raises(jamlab.InputError):
        jamlab.Session(scaled(packings()["sp"], *units))


def test_packings_of_the_papers_are_left_as_they_are():
    for name in ("sp", "dense", "dp", "square"):
        packing = packings()[name]
        assert natural_scales(packing) == Scales() and Scales().to_natural(packing) is packing


@cache
def onset(eps):
    return jamlab.jam(6, "dp", 1, law={"eps": eps, "ka": 300 * eps, "gamma": 0.4 * eps})


@pytest.mark.parametrize(
    "eps", [1e-9, pytest.param(3.0, marks=pytest.mark.slow), pytest.param(7e5, marks=pytest.mark.slow)]
)
def test_droplets_jam_alike_at_any_energy(eps):
    """All energies of the law times one number: the same onset, bit for bit."""
    one, other = onset(1.0), onset(eps)
    assert other.converged and np.array_equal(other.positions, one.positions) and other.params["gamma"] == 0.4 * eps
    assert other.max_force == pytest.approx(eps * one.max_force, rel=1e-12)
    assert other.force_tolerance == pytest.approx(1e-10 * eps, rel=1e-12)


def test_droplets_whose_own_forces_drown_those_of_contacts_are_refused():
    with pytest.raises(jamlab.InputError, match=r"3e\+08"):
        jamlab.jam(6, "dp", 1, law={"eps": 1e-6})
