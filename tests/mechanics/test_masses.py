"""Modes with masses: closed forms, the dense eigenproblem by plain numpy, units, and masses that are refused."""

import numpy as np
import pytest
from features_of_packings import FEATURES
from scipy import linalg

import jamlab

NAMED = (
    *("disks", "rattlers", "exponent 2.5", "eps, leaning", "sticky, p > 0", "fixed some", "rough", "flat"),
    *("N = 2", "N = 1", "droplets", "droplets, flat"),
)
QUICK = ("rattlers", "rough", "droplets")  # the others with -m slow
STATES = [pytest.param(each, marks=[pytest.mark.slow] * (each not in QUICK)) for each in NAMED]


def chain(diameter=1.0, masses=(1.0, 3.0), cells=4):
    """Disks in a row across a box, each in touch with the two next ones; they alternate in mass."""
    n = 2 * cells
    places = np.column_stack([0.9 * diameter * np.arange(n), np.zeros(n)])
    box = np.diag([0.9 * n, 5.0]) * diameter
    packing = jamlab.Packing("sp", box, places, {"k": 1.0}, "k", np.full(n, diameter))
    return packing, np.tile(masses, cells)


def two_disks():
    return jamlab.Packing("sp", 10 * np.eye(2), [[1.0, 1], [1.9, 1]], {"k": 2.0}, "k", [1.0, 1.0])


@pytest.fixture(scope="module", params=STATES)
def state(request):
    p = FEATURES[request.param]()
    return p, np.random.default_rng(3).uniform(0.5, 4.0, p.n)


def test_modes_are_those_of_the_dense_problem_of_plain_numpy(state):
    """H u = omega^2 M u, vertices with equal shares of the mass of their droplet."""
    p, masses = state
    counts = np.array([np.sum(p.particle == i) for i in range(p.n)])
    weight = np.repeat(masses[p.particle] / counts[p.particle], 2)
    fixed = np.zeros(p.n, bool) if p.fixed is None else p.fixed
    free = np.flatnonzero(np.repeat(~fixed[p.particle], 2))
    hessian = jamlab.hessian(p).toarray()[np.ix_(free, free)]
    values = linalg.eigvalsh(hessian, np.diag(weight[free]))
    found = jamlab.lowest_modes(p, None, masses=masses)
    assert found.eigenvalues == pytest.approx(values, abs=1e-10 * max(np.abs(values).max(), 1))
    u = found.vectors.reshape(len(values), -1)
    assert (u * weight) @ u.T == pytest.approx(np.eye(len(values)), abs=1e-10)
    left = hessian @ u[:, free].T - weight[free, None] * u[:, free].T * found.eigenvalues
    assert np.abs(left).max() < 1e-10 * max(np.abs(hessian).max(), 1)
    energies = np.array([[np.sum((weight * v**2)[np.repeat(p.particle == i, 2)]) for i in range(p.n)] for v in u])
    ratio = energies.sum(axis=1) ** 2 / (p.n * (energies**2).sum(axis=1))
    assert found.participation == pytest.approx(ratio, rel=1e-10)


def test_two_disks_vibrate_with_their_reduced_mass():
    found = jamlab.lowest_modes(two_disks(), None, prestress=False, masses=[1.0, 3.0])
    assert found.eigenvalues == pytest.approx([0, 0, 0, 2.0 * (1 + 1 / 3)], abs=1e-13)
    assert found.participation[-1] == pytest.approx(1 / (2 * (0.75**2 + 0.25**2)))  # energies go as the other mass
    apart = found.vectors[-1, :, 0]
    assert apart[0] == pytest.approx(-3 * apart[1]) and [1, 3] @ apart**2 == pytest.approx(1)


def test_a_chain_of_two_masses_has_its_two_branches():
    """omega^2 = k (1/m + 1/M) -+ k sqrt((1/m + 1/M)^2 - 4 sin^2(q/2)/(m M)), q = 2 pi j/cells."""
    packing, masses = chain()
    total, q = 1 / masses[0] + 1 / masses[1], 2 * np.pi * np.arange(4) / 4
    root = np.sqrt(total**2 - 4 * np.sin(q / 2) ** 2 / (masses[0] * masses[1]))
    exact = np.sort(np.concatenate([total - root, total + root, np.zeros(8)]))
    assert jamlab.lowest_modes(packing, None, prestress=False, masses=masses).eigenvalues == pytest.approx(
        exact, abs=1e-13
    )


def test_the_lowest_of_many_are_found_by_iteration():
    """Translations weigh with the roots of the masses."""
    p = jamlab.pack(256, 1e-2, 2)
    masses = np.random.default_rng(0).uniform(0.2, 5.0, p.n)
    few, every = jamlab.lowest_modes(p, 20, masses=masses), jamlab.lowest_modes(p, None, masses=masses)
    assert few.eigenvalues == pytest.approx(every.eigenvalues[:20], abs=1e-12)
    assert few.zero.tolist() == every.zero[:20].tolist() and few.zero.sum() >= 2
    still = few.vectors[~few.zero]
    assert np.abs(np.einsum("i,mik->mk", masses, still)).max() < 1e-8  # no momentum


def test_ways_to_give_masses():
    p = jamlab.pack(16, 1e-2, 1)
    area = np.pi / 4 * p.disk_diameters**2
    one, all_, each = (jamlab.lowest_modes(p, 8, masses=m).eigenvalues for m in (2.0, np.full(16, 2.0), 2 * area))
    assert np.array_equal(one, all_) and not np.allclose(one, each)
    assert np.array_equal(each, jamlab.lowest_modes(p, 8, masses={"density": 2.0}).eigenvalues)
    assert np.array_equal(jamlab.lowest_modes(p, 8, masses=1).eigenvalues, jamlab.lowest_modes(p, 8).eigenvalues)
    droplets = FEATURES["droplets"]()
    areas, given = droplets.params["a0"], jamlab.lowest_modes(droplets, 8, masses={"density": 3.0})
    assert np.array_equal(given.eigenvalues, jamlab.lowest_modes(droplets, 8, masses=3 * areas).eigenvalues)


@pytest.mark.parametrize(("length", "stiffness"), [(1.0, 1.0), (3e-6, 1e-7), (7e2, 4e8)])
def test_frequencies_have_the_unit_root_of_stiffness_over_mass(length, stiffness):
    p = jamlab.pack(16, 1e-2, 1)
    scaled = p.with_state(
        positions=length * p.positions,
        box=length * p.box,
        diameters=length * p.disk_diameters,
        params={"k": stiffness},
    )
    plain = jamlab.lowest_modes(p, None, masses={"density": 2.0})
    found = jamlab.lowest_modes(scaled, None, masses={"density": 0.1})
    unit = stiffness / (0.05 * length**2)
    assert found.eigenvalues == pytest.approx(plain.eigenvalues * unit, abs=1e-10 * unit)
    assert found.zero.tolist() == plain.zero.tolist()


def test_a_density_of_states_with_masses():
    packings = [jamlab.pack(32, 1e-3, seed) for seed in (1, 2)]
    plain, heavy = (jamlab.density_of_states(packings, 8, masses=m, rattlers=False) for m in (None, 4.0))
    assert heavy.omega == pytest.approx(0.5 * plain.omega) and heavy.density == pytest.approx(2 * plain.density)
    rattling = [p for p in packings if jamlab.contacts(p).rattlers.any()]
    masses = np.random.default_rng(1).uniform(1, 2, 32)
    kept = ~jamlab.contacts(rattling[0]).rattlers
    by_hand = jamlab.lowest_modes(jamlab.remove_rattlers(rattling[0]), None, masses=masses[kept])
    found = jamlab.density_of_states(rattling[0], [0.0, 1, 3], rattlers=False, masses=masses)
    assert np.array_equal(found.density, by_hand.density([0.0, 1, 3]).density)


BAD = {
    "negative": (-1.0, "particle 0 has the mass -1"),
    "zero": (0, "must be positive"),
    "one of them": (np.where(np.arange(16) == 3, 0.0, 1.0), "particle 3 has the mass 0"),
    "too few": (np.ones(5), "5 numbers for 16 particles: give one a particle"),
    "two axes": (np.ones((16, 2)), r"shape \(any\), got \(16, 2\)"),
    "nan": ([float("nan")] * 16, r"masses\[0\] is nan"),
    "huge": (1e120, "to 1e.100"),
    "far apart": (np.geomspace(1, 1e5, 16), "masses from 1 to 100000: .* at most 10000"),
    "text": ("heavy", "masses = 'heavy'"),
    "another key": ({"rho": 1.0}, "give {'density': mass per area}"),
    "no key": ({}, "give {'density': mass per area}"),
    "density of none": ({"density": -2.0}, "must be positive"),
    "density in words": ({"density": "iron"}, "must hold numbers"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_masses_are_refused(name):
    p = jamlab.pack(16, 1e-2, 1)
    masses, words = BAD[name]
    for call in (jamlab.lowest_modes, jamlab.damped_vibrations, jamlab.density_of_states):
        with pytest.raises(jamlab.InputError, match=words):
            call(p, masses=masses)


def test_unequal_masses_change_no_number_of_zero_modes():
    for p in (FEATURES["rattlers"](), FEATURES["droplets"]()):
        masses, zero = np.geomspace(1, 1e4, p.n), jamlab.count_zero_modes(p)
        assert jamlab.lowest_modes(p, None, masses=masses).zero.sum() == zero
        assert jamlab.damped_vibrations(p, masses=masses).free == zero
        masses[0] = 1e9  # of a particle that does not move
        held = p.with_state(fixed=np.arange(p.n) == 0)
        assert jamlab.lowest_modes(held, None, masses=masses).zero.sum() == jamlab.count_zero_modes(held)
