"""Quasi-localised modes against plain numpy: cost and slope pair by pair, another minimiser, waves, bad input."""

import numpy as np
import pytest
from features_of_packings import FEATURES
from scipy import optimize

import jamlab
from jamlab.mechanics import quasilocalized_modes as module

NAMED = (
    *("disks", "leaning", "rattlers", "exponent 2.5", "lognormal", "eps, leaning", "other units", "sticky, p > 0"),
    *("fixed some", "rough", "droplets", "droplets, fixed"),
)
QUICK = ("rattlers", "fixed some", "droplets")  # the others with -m slow
STATES = [pytest.param(each, marks=[pytest.mark.slow] * (each not in QUICK)) for each in NAMED]


def cost_and_slope(p, z):
    """C of displacements (n_sites, 2) and dC/dz, from the Hessian and a list of pairs, one by one."""
    stiff = jamlab.hessian(p).toarray()
    energy, force = z.ravel() @ stiff @ z.ravel(), (stiff @ z.ravel()).reshape(-1, 2)
    means = np.array([z[p.particle == i].mean(axis=0) for i in range(p.n)])
    network = jamlab.contacts(p)
    total, slope = 0.0, np.zeros((p.n, 2))
    for i, j in network.pairs:
        if i != j and not (network.rattlers[i] or network.rattlers[j]):
            apart = means[j] - means[i]
            total += (apart @ apart) ** 2
            slope[j] += 4 * (apart @ apart) * apart
            slope[i] -= 4 * (apart @ apart) * apart
    share = slope[p.particle] / np.bincount(p.particle)[p.particle][:, None]
    still = np.zeros(p.n, bool) if p.fixed is None else p.fixed
    gradient = 4 * energy * force / total - energy**2 * share / total**2
    gradient[(still | network.rattlers)[p.particle]] = 0
    return energy**2 / total, gradient


@pytest.mark.parametrize("name", STATES)
def test_a_mode_is_a_minimum_of_the_cost_of_plain_numpy(name):
    p = FEATURES[name]()
    found = jamlab.quasilocalized_modes(p, 4)
    stiff = jamlab.hessian(p).toarray()
    for z, cost, value in zip(found.vectors, found.cost, found.eigenvalues, strict=True):
        own, slope = cost_and_slope(p, z)
        assert cost == pytest.approx(own, rel=1e-10)
        assert value == pytest.approx(z.ravel() @ stiff @ z.ravel(), rel=1e-10) and np.sum(z**2) == pytest.approx(1)
        assert np.abs(slope).max() < 1e-6 * own  # linear in the residual
        for seed in range(4):
            push = np.random.default_rng(seed).normal(size=z.shape) * (np.abs(z).max(axis=1, keepdims=True) > 0)
            assert cost_and_slope(p, z + 1e-3 * np.abs(z).max() * push)[0] > own
    assert (np.diff(found.eigenvalues) >= 0).all() and found.starts.sum() == 4
    assert (found.residual <= module.MINIMISATION.tolerance).all()


def test_another_minimiser_finds_the_same_cost():
    """BFGS of scipy from the same harmonic mode."""
    p = FEATURES["disks"]()
    modes = jamlab.lowest_modes(p, None)
    start = modes.vectors[~modes.zero][0]
    own = optimize.minimize(
        lambda z: tuple(np.ravel(each) for each in cost_and_slope(p, z.reshape(-1, 2))),
        start.ravel(),
        jac=True,
        method="BFGS",
        options={"gtol": 1e-12},
    )
    found = jamlab.quasilocalized_modes(p, starts=start[None])
    assert found.cost[0] == pytest.approx(float(np.ravel(own.fun)[0]), rel=1e-8)


def test_steps_lower_the_cost(monkeypatch):
    """The sum of fourth powers at constant energy rises in every step: it is convex."""
    p, sums = jamlab.pack(64, 1e-1, 2), []
    before = module._Cost._slope

    def seen(self, z):
        slope, fourth = before(self, z)
        sums.append(fourth.copy())
        return slope, fourth

    monkeypatch.setattr(module._Cost, "_slope", seen)
    jamlab.quasilocalized_modes(p, 1)
    rise = np.diff(np.ravel(sums[1:])) / sums[-1]
    assert len(rise) > 10 and (rise >= -1e-13).all()


def test_modes_of_a_wave_are_refined_to_a_spot():
    """The lowest harmonic mode of a large dense packing is a wave; the mode below it in cost lies in few particles."""
    p = jamlab.pack(256, 1e-1, 3)
    harmonic = jamlab.lowest_modes(p, 30)
    found = jamlab.quasilocalized_modes(p, 12)
    first = np.flatnonzero(~harmonic.zero)[0]
    assert found.participation[0] < 0.5 * harmonic.participation[first]
    assert found.frequencies[0] >= harmonic.frequencies[first] and 1 < len(found.cost) <= 12


@pytest.mark.parametrize("size", [1e-200, 1e200])
def test_starts_of_any_length_end_in_the_same_minimum(size):
    p = jamlab.pack(16, 1e-2, 1)
    start = np.random.default_rng(2).standard_normal((1, 16, 2))
    one, other = (jamlab.quasilocalized_modes(p, starts=each) for each in (start, size * start))
    assert other.cost[0] == pytest.approx(one.cost[0], rel=1e-9)


def test_masses_change_frequencies_alone():
    p = jamlab.pack(64, 1e-1, 2)
    plain, heavy = jamlab.quasilocalized_modes(p, 5), jamlab.quasilocalized_modes(p, 5, masses=4.0)
    assert np.array_equal(plain.cost, heavy.cost) and heavy.frequencies == pytest.approx(0.5 * plain.frequencies)
    masses = np.random.default_rng(2).uniform(1, 2, 64)
    found = jamlab.quasilocalized_modes(p, 5, masses=masses)
    assert np.sort(found.cost) == pytest.approx(np.sort(plain.cost), rel=1e-12)
    assert np.einsum("i,mik->mk", masses[~jamlab.contacts(p).rattlers], found.vectors[:, ~jamlab.contacts(p).rattlers])[
        0
    ] == pytest.approx([0, 0], abs=1e-10)


def test_an_iteration_that_does_not_end_is_said(monkeypatch):
    monkeypatch.setattr(module, "MINIMISATION", module.CostMinimisation(most_steps=3))
    with pytest.raises(jamlab.ConvergenceError, match="after 3 steps"):
        jamlab.quasilocalized_modes(FEATURES["disks"](), 2)


def _apart():
    return jamlab.Packing("sp", 9 * np.eye(2), [[1.0, 1], [4, 4]], {"k": 1.0}, "k", [1.0, 1.0])


def _moved():
    p = FEATURES["disks"]()
    return p.with_state(positions=p.positions + 0.01 * np.sin(9 * p.positions))


BAD = {
    "count": (lambda p: jamlab.quasilocalized_modes(p, 0), "count = 0"),
    "many": (lambda p: jamlab.quasilocalized_modes(p, 400), "modes with a frequency above zero"),
    "half": (lambda p: jamlab.quasilocalized_modes(p, 2.5), "count = 2.5"),
    "shape": (lambda p: jamlab.quasilocalized_modes(p, starts=np.ones((16, 2))), r"starts must have shape \(any, 16"),
    "no start": (lambda p: jamlab.quasilocalized_modes(p, starts=np.ones((0, 16, 2))), "give one displacement"),
    "drift": (lambda p: jamlab.quasilocalized_modes(p, starts=np.ones((1, 16, 2))), r"starts\[0\] moves no two"),
    "nan": (lambda p: jamlab.quasilocalized_modes(p, starts=np.full((1, 16, 2), np.nan)), "must be finite"),
    "masses": (lambda p: jamlab.quasilocalized_modes(p, masses=-1), "must be positive"),
    "flat walls": (lambda p: jamlab.quasilocalized_modes(FEATURES["flat"]()), "use rough walls"),
    "unjammed": (lambda p: jamlab.quasilocalized_modes(_apart()), "unjammed"),
    "moved": (lambda p: jamlab.quasilocalized_modes(_moved()), "relax it first"),
    "one disk": (lambda p: jamlab.quasilocalized_modes(FEATURES["N = 1"]()), "0 modes with a frequency above zero"),
    "droplets": (lambda p: jamlab.quasilocalized_modes(FEATURES["droplets"](), prestress=False), "pre-?stress"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_has_no_quasilocalised_modes_is_refused(name):
    call, words = BAD[name]
    with pytest.raises(jamlab.JamlabError, match=words):
        call(FEATURES["disks"]())
