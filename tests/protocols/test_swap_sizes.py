"""Swap Monte Carlo: trials of plain numpy to the last bit, weights of Boltzmann, the same sizes, lower energies."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import plain_swaps
import pytest

import jamlab
from jamlab.protocols.swap_sizes import MetropolisDisks
from jamlab.protocols.thermal_history import contact_energy

WIDE = "lognormal:0.2"


def disks(n, units="k", exponent=2.0, tilt=0.0, side=3.0, seed=3, **more):
    """Random disks of as many sizes, some boxes away from the cell."""
    random = np.random.default_rng([seed, n])
    box = np.array([[side, 0.0], [tilt * side, 1.1 * side]])
    positions = random.random((n, 2)) @ box + 3 * box[0]
    params = {units: 1.3, "exponent": exponent}
    return jamlab.Packing("sp", box, positions, params, units, random.uniform(0.7, 1.3, n), **more)


CASES = {
    "k": disks(8),
    "eps, tilted": disks(8, "eps", tilt=0.3),
    "Hertz, tilted by two boxes": disks(6, exponent=2.5, tilt=-1.7, side=2.5),
    "meeting own images": disks(4, "eps", 3.0, tilt=0.4, side=1.0),
    "one": disks(1, tilt=0.2, side=0.8),
    "two": disks(2, side=1.1),
    "some fixed": disks(8, fixed=np.arange(8) < 3),
}


@pytest.fixture(scope="module")
def quenched():
    return jamlab.pack(n=32, phi=0.9, seed=1, sizes=WIDE)


@pytest.mark.parametrize("temperature", [1e-3, 0.1])
@pytest.mark.parametrize("name", [*CASES, "flat walls"])
def test_one_sweep_is_that_of_plain_numpy_to_the_last_bit(name, temperature):
    p = CASES.get(name) or jamlab.with_walls(jamlab.pack(n=8, phi=0.8, seed=1, sizes=WIDE), flat=True)
    metropolis, unit = MetropolisDisks(p, 5), contact_energy(p)
    mean = metropolis.run(temperature, 1, 0.4)[0]
    move = min(2 * temperature ** (1 / p.params.get("exponent", 2.0)), 0.5) * p.frame.sizes.mean()
    x, d, energy = plain_swaps.sweep(p, np.random.default_rng(5), temperature * unit, move, 0.4)
    found = metropolis.packing()
    assert np.array_equal(found.positions, x) and np.array_equal(found.disk_diameters, d)
    disks = p.n - p.flat_walls.sum()
    assert mean * unit * disks == pytest.approx(energy, rel=1e-12, abs=1e-15)
    assert jamlab.evaluate(found).energy == pytest.approx(energy, rel=1e-11, abs=1e-15)


@pytest.mark.parametrize("samples, bins", [(2000, 53)])
def test_distances_of_two_disks_have_the_weights_of_boltzmann(samples, bins):
    p, heat = disks(2, tilt=0.3, side=2.0), 0.05
    metropolis, edges = MetropolisDisks(p, 1), np.linspace(0, 1.3, bins)
    at = []
    for _ in range(samples):
        metropolis.run(heat, 30, 0.2)
        at.append(plain_swaps.shortest(p, metropolis.packing().positions))
    wanted = plain_swaps.distances_of_two(p, heat * contact_energy(p), edges, 400)
    assert plain_swaps.chi_square(np.histogram(at, edges)[0], wanted) < 2.2  # of seven bins or more: once in 30


def test_the_shortest_distance_of_disks_that_are_many_cells_apart():
    p = disks(2, tilt=0.3, side=2.0)
    far = p.positions + np.array([[0.0, 0.0], [9.0, -7.0] @ p.box])
    assert plain_swaps.shortest(p, far) == pytest.approx(plain_swaps.shortest(p, p.positions), abs=1e-12)


def test_orders_of_three_sizes_have_the_weights_of_boltzmann():
    p, heat = replace(disks(4, side=1.4), fixed=np.arange(4) == 0), 0.05
    metropolis, sizes, seen = MetropolisDisks(p, 1), p.disk_diameters, {}
    for _ in range(800):
        metropolis.run(heat, 4, 1.0)
        order = tuple(metropolis.packing().disk_diameters)
        seen[order] = seen.get(order, 0) + 1
    weights = {order: np.exp(-plain_swaps.energy(p, p.positions, np.array(order)) / heat / contact_energy(p))
               for order in seen}  # fmt: skip
    assert len(seen) == 6 and all(order[0] == sizes[0] for order in seen)
    counts, weight = np.array([*seen.values()]), np.array([*weights.values()])
    assert plain_swaps.chi_square(counts, weight / weight.sum()) < 3.4 and np.ptp(counts) > 80


def test_sizes_are_the_same_and_energies_lower():
    for seed in (1, 2):
        p = jamlab.pack(n=32, phi=0.9, seed=seed, sizes=WIDE)
        found = jamlab.swap_sizes(p, sweeps=100, seed=seed).packing
        assert np.array_equal(np.sort(found.diameters), np.sort(p.diameters))
        assert found.phi == p.phi and found.converged and np.array_equal(found.box, p.box)
        assert jamlab.evaluate(found).energy < 0.8 * jamlab.evaluate(p).energy


def test_history_seed_recipe_and_provenance(quenched):
    told = []
    found = jamlab.swap_sizes(quenched, [1e-2, 1e-5], 60, seed=4, progress=lambda *now: told.append(now))
    q = found.packing
    assert len(found.to_dataframe()) == len(told) == 50 and told[-1][0] == 1 and found.sweep[-1] == 60
    assert found.temperature[[0, -1]] == pytest.approx([1e-2, 1e-5])
    assert np.ptp(np.diff(np.log(found.temperature))) < 1e-12
    assert 0.1 < np.nanmean(found.moved) < 0.7 and 0 < np.nanmean(found.swapped) < 0.5
    assert q.provenance["protocol"] == "swap_sizes" and q.provenance["swap_seed"] == 4 and q.provenance["seed"] == 1
    assert q.phi_J is None and q.provenance["jamlab"] == jamlab.__version__
    assert jamlab.make(q.recipe) == q != jamlab.swap_sizes(quenched, [1e-2, 1e-5], 60, seed=5).packing
    assert "of swaps" in found.plot().get_legend().get_title().get_text()


def test_threads_change_no_bit(quenched):
    def run(seed):
        return jamlab.swap_sizes(quenched, sweeps=20, seed=seed).packing

    with ThreadPoolExecutor(2) as pool:
        assert list(pool.map(run, [1, 2, 1])) == [run(1), run(2), run(1)]


def test_a_pressure_is_met_denser_than_before(quenched):
    found = jamlab.swap_sizes(quenched, sweeps=300, pressure=1e-3).packing
    assert jamlab.evaluate(found).pressure == pytest.approx(1e-3, rel=1e-6)
    assert found.converged and found.phi > jamlab.decompress(quenched, 1e-3).phi
    assert jamlab.make(found.recipe) == found


def test_fixed_disks_keep_place_and_size(quenched):
    for p in (jamlab.with_walls(quenched, 1.6), jamlab.relax(jamlab.with_walls(quenched, flat=True))):
        q = jamlab.swap_sizes(p, sweeps=20).packing
        assert np.array_equal(q.disk_diameters[p.fixed], p.disk_diameters[p.fixed]) and q.walls
        assert np.allclose(q.positions[p.fixed], p.positions[p.fixed], rtol=0, atol=1e-13)
        assert not np.array_equal(q.diameters, p.diameters)


def test_equal_sizes_and_units():
    p = jamlab.pack(n=16, phi=0.85, seed=1, sizes="monodisperse")
    found = jamlab.swap_sizes(p, 1e-3, 20)
    assert np.nansum(found.swapped) == 0 and np.array_equal(found.packing.diameters, p.diameters)
    metres = 2.0**-18  # of a length: no digit changes
    q = p.with_state(box=p.box * metres, positions=p.positions * metres, diameters=p.diameters * metres)
    assert np.array_equal(jamlab.swap_sizes(q, 1e-3, 20).packing.positions, metres * found.packing.positions)


BAD = {
    "negative temperature": (dict(temperature=-1e-3), "temperature = -0.001"),
    "no temperature": (dict(temperature=0.0), "temperature = 0"),
    "hot": (dict(temperature=7.0), "temperature = 7"),
    "an empty list": (dict(temperature=[]), "give a number"),
    "a table": (dict(temperature=[[1e-3, 1e-4]]), "give a number"),
    "not finite": (dict(temperature=[1e-3, float("nan")]), "temperature"),
    "no sweep": (dict(sweeps=0), "sweeps = 0"),
    "half a sweep": (dict(sweeps=1.5), "sweeps = 1.5"),
    "share": (dict(swap_share=1.5), "swap_share = 1.5"),
    "seed": (dict(seed=-1), "seed = -1"),
    "tolerance": (dict(force_tolerance=1.0), "force_tolerance = 1"),
    "pressure": (dict(pressure=-1e-3), "pressure = -0.001"),
}


@pytest.mark.parametrize("given, words", BAD.values(), ids=BAD)
def test_wrong_arguments_are_named(quenched, given, words):
    with pytest.raises(jamlab.InputError, match=words):
        jamlab.swap_sizes(quenched, **given)


def test_what_cannot_swap_is_refused_by_name():
    sticky = jamlab.pack(n=16, phi=0.8, seed=1, law={"stickiness": 0.05})
    with pytest.raises(jamlab.InputError, match=r"sticky disks of stickiness 0.05 .* use jamlab.anneal"):
        jamlab.swap_sizes(sticky)
    droplets = jamlab.read(Path(__file__).parents[1] / "states" / "few_droplets.h5")
    for function in (jamlab.swap_sizes, jamlab.relax_radii):
        with pytest.raises(jamlab.InputError, match=r"model 'dp': .* jamlab.anneal"):
            function(droplets)
