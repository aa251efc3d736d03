"""Thermal annealing by LAMMPS: equipartition, weights of Boltzmann, quenches, refusals."""

import numpy as np
import plain_swaps
import pytest

import jamlab
from jamlab.protocols.anneal import LangevinBath
from jamlab.protocols.thermal_history import contact_energy


@pytest.fixture(scope="module")
def quenched():
    return jamlab.pack(n=32, phi=0.9, seed=1)


def _heat(found, skip=0.2):
    """Mean kinetic over bath temperature once warm, and its error."""
    share = (found.kinetic_temperature / found.temperature)[int(skip * len(found.temperature)) :]
    return share.mean(), share.std() / np.sqrt(len(share) - 1)


def test_each_degree_of_freedom_has_half_the_temperature(quenched):
    kinds = {
        "disks": quenched,
        "sticky": jamlab.pack(n=16, phi=0.8, seed=1, law={"stickiness": 0.05}),
        "walls": jamlab.with_walls(quenched, 1.6),
        "flat": jamlab.relax(jamlab.with_walls(quenched, flat=True)),
        "one": jamlab.Packing("sp", [[2.0, 0], [0, 2.0]], [[1.0, 1.0]], {"eps": 3.0}, "eps", [1.0]),
    }
    for name, p in kinds.items():
        found = jamlab.anneal(p, 1e-3, 250 if p.n > 1 else 3000, seed=2)
        mean, error = _heat(found)
        assert abs(mean - 1) < 4 * error + 0.005 and error < 0.04, name
        fixed = p.frame.fixed
        assert np.allclose(found.packing.positions[fixed], p.positions[fixed], rtol=0, atol=1e-12), name
        assert found.packing.converged, name


def test_droplets_are_warm_and_whole():
    p = jamlab.jam(4, "dp", seed=1)
    found = jamlab.anneal(p, 1e-4, 20)
    mean, error = _heat(found, 0.4)
    assert abs(mean - 1) < 4 * error + 0.005 and error < 0.05
    assert found.packing.converged and found.packing.phi_J is None and found.energy[-1] > found.energy[0]
    with pytest.raises(jamlab.ConvergenceError, match="use a lower temperature"):
        jamlab.anneal(p, 0.5, 20)


@pytest.mark.slow
def test_distances_of_two_disks_have_the_weights_of_boltzmann():
    box, law = [[2.0, 0.0], [0.6, 2.2]], {"k": 1.3}
    p = jamlab.Packing("sp", box, [[0.1, 0.2], [1.1, 1.2]], law, "k", [0.8, 1.2])
    edges, at, heat = np.linspace(0, 1.3, 27), [], 0.05
    with LangevinBath(p, 1) as bath:
        for _ in range(4000):
            bath.run(heat, 400)
            at.append(plain_swaps.shortest(p, bath.packing().positions))
    wanted = plain_swaps.distances_of_two(p, heat * contact_energy(p), edges)
    assert plain_swaps.chi_square(np.histogram(at, edges)[0], wanted) < 1.7


def test_history_seed_recipe_and_provenance(quenched):
    found = jamlab.anneal(quenched, [1e-2, 1e-4], 50, seed=3)
    q = found.packing
    assert jamlab.make(q.recipe) == q != jamlab.anneal(quenched, [1e-2, 1e-4], 50, seed=4).packing
    assert q.provenance["protocol"] == "anneal" and q.provenance["bath_seed"] == 3 and q.provenance["seed"] == 1
    assert found.temperature[[0, -1]] == pytest.approx([1e-2, 1e-4]) and found.time[-1] >= 50
    assert len(found.to_dataframe()) == len(found.energy) == 50
    assert len(found.plot().lines) == 2


@pytest.mark.slow
def test_cooling_finds_lower_minima():
    before, after = [], []
    for seed in range(1, 11):
        p = jamlab.pack(n=64, phi=0.86, seed=seed)
        before.append(jamlab.evaluate(p).energy)
        after.append(jamlab.evaluate(jamlab.anneal(p, (1e-2, 1e-6)).packing).energy)
    assert np.mean(after) < 0.9 * np.mean(before)


def test_a_pressure_is_met(quenched):
    found = jamlab.anneal(quenched, 1e-3, 10, pressure=1e-2).packing
    assert found.converged and jamlab.evaluate(found).pressure == pytest.approx(1e-2, rel=1e-6)


@pytest.mark.parametrize(
    "given, words",
    [
        (dict(temperature=0.0), "temperature = 0"),
        (dict(temperature=-1.0), "temperature = -1"),
        (dict(temperature=2.0), "temperature = 2"),
        (dict(temperature=[]), "give a number"),
        (dict(temperature=["hot"]), "temperature"),
        (dict(duration=0.0), "duration = 0"),
        (dict(duration=-1.0), "duration = -1"),
        (dict(seed=-3), "seed = -3"),
        (dict(pressure=-1.0), "pressure = -1"),
        (dict(force_tolerance=1e-20), "force_tolerance"),
    ],
)
def test_wrong_arguments_are_named(quenched, given, words):
    with pytest.raises(jamlab.InputError, match=words):
        jamlab.anneal(quenched, **given)
