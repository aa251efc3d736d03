"""Disks whose energy grows as a power above 2 of their overlap: Hertz' elastic spheres, 5/2, and others."""

import numpy as np
import pytest

import jamlab
from jamlab.engine.disk_fire import fire_disks
from jamlab.flow.overdamped_session import OverdampedSession
from jamlab.laws.power import PowerLaw
from jamlab.mechanics.stiffness import energy_terms, stress
from jamlab.protocols.random_start import random_disks
from tests.support.deck_runs import run

EXPONENTS = (2.0, 2.5, 3.3)


def crowd(law="eps", exponent=2.5, n=24, seed=3):
    """Random disks of two sizes that overlap, in a box that leans."""
    rng = np.random.default_rng(seed)
    box = np.array([[4.6, 0.0], [1.1, 4.2]])
    diameters = np.where(np.arange(n) % 2, 0.9, 1.25)
    params = {law: 1.7, "exponent": exponent}
    return jamlab.Packing("sp", box, rng.random((n, 2)) @ box, params, law, diameters)


def plain_loops(packing):
    """Energy, forces and stress by loops over pairs and images."""
    exponent, eps = packing.params["exponent"], packing.units == "eps"
    energy, forces, moment = 0.0, np.zeros((packing.n, 2)), np.zeros((2, 2))
    for i in range(packing.n):
        for j in range(packing.n):
            for a in (-1, 0, 1):
                for b in (-1, 0, 1):
                    r = packing.positions[j] + np.array([a, b]) @ packing.box - packing.positions[i]
                    distance, s = np.sqrt(r @ r), (packing.diameters[i] + packing.diameters[j]) / 2
                    if (i == j and a == 0 == b) or distance >= s:
                        continue
                    strength = packing.params["eps"] if eps else packing.params["k"] * s**2
                    push = strength * (1 - distance / s) ** (exponent - 1) / s
                    energy += strength / exponent * (1 - distance / s) ** exponent / 2
                    forces[i] -= push * r / distance
                    moment += push * np.outer(r, r) / distance / 2
    return energy, forces, moment / packing.area


@pytest.mark.parametrize("law", ["eps", "k"])
@pytest.mark.parametrize("exponent", EXPONENTS)
def test_energy_forces_and_stress_of_lammps_are_those_of_plain_loops_and_of_the_terms(law, exponent):
    packing = crowd(law, exponent)
    positions = packing.positions - np.floor(packing.positions @ np.linalg.inv(packing.box)) @ packing.box
    packing = packing.with_state(positions=positions)
    energy, forces, pushed = plain_loops(packing)
    found = jamlab.evaluate(packing)
    assert found.energy == pytest.approx(energy, rel=1e-12)
    assert np.abs(found.forces - forces).max() < 1e-12 and np.abs(found.stress - pushed).max() < 1e-12
    (terms,) = energy_terms(packing)
    assert terms.energy.sum() == pytest.approx(energy, rel=1e-12)
    assert np.abs(stress(packing) - pushed).max() < 1e-12


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_hessian_is_the_slope_of_the_forces(exponent):
    packing, step = crowd("eps", exponent), 1e-6
    matrix = jamlab.hessian(packing).toarray()
    for k in range(0, 2 * packing.n, 5):
        moved = np.zeros((packing.n, 2))
        moved.flat[k] = step
        states = (packing.with_state(positions=packing.positions + sign * moved) for sign in (1, -1))
        up, down = (jamlab.evaluate(state).forces for state in states)
        assert np.abs((down - up).ravel() / (2 * step) - matrix[:, k]).max() < 2e-7 * np.abs(matrix).max() + 3e-6


@pytest.mark.parametrize("exponent", [2.5, 3.0, 4.2])
def test_fire_of_the_kernel_ends_at_a_minimum_of_the_law(exponent):
    packing, _, left = fire_disks(random_disks(40, 1, phi=0.95, units="k", exponent=exponent), 1e-9, 100_000)
    assert left < 1e-9 and jamlab.evaluate(packing).max_force == pytest.approx(left, abs=1e-14)


@pytest.mark.parametrize("law", ["eps", "k"])
def test_flowing_disks_repel_by_the_same_law(law):
    packing = crowd(law, 2.5)
    with OverdampedSession(packing, jamlab.ContactDamping(), 1e-4, 1e-2) as session:
        state = session.drive("rate 1e-3", 1.0)
    found = jamlab.evaluate(packing)
    assert state.elastic_stress == pytest.approx(-found.stress[0, 1], rel=1e-12)
    assert state.energy == pytest.approx(found.energy / packing.area, rel=1e-12)


def test_small_oscillations_in_time_have_the_modulus_over_frequency():
    packing = jamlab.pack(32, 1e-2, 2, law={"exponent": 2.5}, ensemble="shear-stabilized")
    linear = jamlab.complex_modulus(packing, [0.5])
    run = jamlab.oscillate(packing, 0.5, 1e-6, cycles=3, background_drag=0.0, tolerance=1e-5)
    assert run.storage == pytest.approx(linear.storage[0], rel=1e-3)
    assert run.loss == pytest.approx(linear.loss[0], rel=1e-3)


@pytest.mark.parametrize("ensemble", ["fixed-box", "shear-stabilized"])
@pytest.mark.parametrize("exponent", [2.5, 3.0])
def test_pressure_is_met_and_strain_gives_the_moduli_of_linear_response(exponent, ensemble):
    packing = jamlab.pack(32, 1e-3, 1, law={"exponent": exponent}, ensemble=ensemble)
    assert packing.converged and packing.params == {"k": 1.0, "exponent": exponent}
    assert jamlab.measure(packing, ["pressure"])["pressure"] == pytest.approx(1e-3, rel=1e-6)
    assert jamlab.shear_modulus(packing, "finite-strain") == pytest.approx(jamlab.shear_modulus(packing), rel=1e-6)
    assert jamlab.bulk_modulus(packing, "finite-strain") == pytest.approx(jamlab.bulk_modulus(packing), rel=1e-6)


def test_onset_is_isostatic_and_pressure_grows_as_the_power_3_2():
    onset = jamlab.jam(n=32, seed=1, law={"exponent": 2.5})
    found = jamlab.contacts(onset)
    assert onset.converged and found.n_contacts == found.isostatic
    states = list(jamlab.compress(onset, onset.phi + 0.01, 2e-3, by="phi", first_step=1e-3, per_decade=4))
    above = np.array([p.phi for p in states]) - onset.phi
    pressure = np.array([jamlab.measure(p, ["pressure"])["pressure"] for p in states])
    assert all(p.converged for p in states)
    slope = np.polyfit(np.log(above), np.log(pressure), 1)[0]
    assert slope == pytest.approx(1.5, abs=0.15)


def test_law_of_exponent_2_is_that_of_springs_bit_for_bit():
    reach, distance = np.array([1.0, 0.83333]), np.array([0.97, 0.8])
    for name in ("eps", "k"):
        spring = PowerLaw(name, 1.3)
        k = 1.3 / reach**2 if name == "eps" else np.full(2, 1.3)
        energy, slope, stiffness = spring(reach, distance)
        overlap = reach - distance
        assert (energy == 0.5 * k * overlap**2).all() and (slope == -k * overlap).all() and (stiffness == k).all()
        assert spring.linear_in_phi(0.02) == 0.02 / 1.3 and spring.springs


@pytest.mark.parametrize("exponent", [1.9, 11.0, np.nan, "2.5", True])
def test_exponents_out_of_range_are_refused(exponent):
    with pytest.raises(jamlab.JamlabError, match="exponent"):
        jamlab.jam(n=8, law={"exponent": exponent})
    with pytest.raises(jamlab.InputError, match=r"at most 0\.1643"):  # disks would pass through each other
        jamlab.pack(8, 0.2, law={"exponent": 2.5})


def test_decks_reach_a_pressure_of_hertzian_disks(tmp_path):
    run("in.sp.pressure", tmp_path, n=32, exponent=2.5, pressure=1e-3)
    packing = jamlab.read(str(tmp_path / "sp.pressure.data"))
    assert packing.params == {"k": 1.0, "exponent": 2.5, "stickiness": 0.0} and packing.converged
    assert jamlab.evaluate(packing).pressure == pytest.approx(1e-3, rel=1e-6)
