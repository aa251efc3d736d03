"""Spectra of non-affine displacements against plain sums, fields of known spectrum, limits and what is refused."""

from functools import cache
from pathlib import Path

import numpy as np
import own_structure as own
import pytest

import jamlab
from jamlab.rheology.displacement_spectrum import power_of
from jamlab.structure.structure_factor import waves_of

K_MAX = 7.0
STABLE = "shear-stabilized"


@cache
def disks(name):
    if name == "tilted":
        return jamlab.pack(24, 1e-2, seed=2, ensemble=STABLE)
    if name == "many sizes":
        return jamlab.pack(25, 1e-2, seed=1, ensemble=STABLE, sizes="lognormal:0.3")
    if name == "eps":
        return jamlab.pack(16, 1e-2, seed=4, ensemble=STABLE, units="eps")
    return jamlab.pack(32, 1e-3, seed=1, ensemble=STABLE)  # with rattlers


@cache
def droplets():
    return jamlab.read(Path(__file__).parents[1] / "states" / "compressed_droplets.h5")


DISKS = ("tilted", "many sizes", "eps", "rattlers")


def modulus(p, omega, damping=None):
    found = jamlab.complex_modulus(p, omega, damping, method="direct")
    return found.storage[0] + 1j * found.loss[0]


def own_powers(box, points, u):
    """Powers by a sum for every wavevector in turn, the mean over k and -k of complex u."""
    u = u - u.mean(axis=0)
    k = own.wavevectors(box, K_MAX)
    found = []
    for sign in (1.0, -1.0):
        sums = np.exp(-1j * sign * k @ own.wrapped(points, box).T) @ u
        along = (sums * k).sum(axis=1) / np.hypot(*k.T)
        across = (sums[:, 1] * k[:, 0] - sums[:, 0] * k[:, 1]) / np.hypot(*k.T)
        found.append([np.abs(part) ** 2 / len(u) for part in (across, along)])
    return np.mean(found, axis=0)


def assert_same(found, wanted, tolerance=1e-10):
    for name, each in zip(("transverse", "longitudinal"), wanted, strict=True):
        values = getattr(found, name)
        assert values.shape == each.shape
        assert np.abs(values - each).max() < tolerance * np.abs(wanted).max(), name


@pytest.mark.parametrize("prestress", [True, False])
@pytest.mark.parametrize("name", DISKS)
def test_slow_shear_of_disks_is_a_plain_sum(name, prestress):
    p = disks(name)
    u = jamlab.nonaffine_response(p, prestress=prestress).nonaffine
    backbone = jamlab.remove_rattlers(p)
    found = jamlab.displacement_spectrum(p, K_MAX, prestress=prestress)
    assert np.abs(found.wavevectors - own.wavevectors(p.box, K_MAX)).max() < 1e-12 * K_MAX
    assert_same(found, own_powers(p.box, backbone.positions, u))
    assert len(u) == backbone.n and (backbone.n < p.n or name != "rattlers")


@pytest.mark.parametrize("name", DISKS)
@pytest.mark.parametrize("damping", [None, jamlab.StokesDrag(eta_f=0.5)], ids=str)
def test_a_frequency_is_a_plain_sum_per_strain(name, damping):
    p, omega = disks(name), 0.05
    backbone, per_stress = jamlab.displacement_response(p, omega, damping)
    u = per_stress * modulus(p, omega, damping)
    assert np.abs(u.imag).max() > 1e-3 * np.abs(u.real).max()
    found = jamlab.displacement_spectrum(p, K_MAX, omega, damping)
    assert_same(found, own_powers(p.box, backbone.positions, u))


def own_centroid(x, y):
    """Centroid of a polygon, of real or complex vertices."""
    cross = x * np.roll(y, -1) - np.roll(x, -1) * y
    area = cross.sum() / 2
    return np.array([(cross * (each + np.roll(each, -1))).sum() / (6 * area) for each in (x, y)])


@pytest.mark.parametrize("omega", [None, 0.3])
def test_droplets_move_by_their_centroids(omega):
    """A step along the imaginary axis gives the derivative of the centroid to rounding."""
    p = droplets()
    if omega is None:
        network = jamlab.remove_rattlers(p)
        held = np.isin(p.particle, np.flatnonzero(~jamlab.contacts(p).rattlers))
        u = jamlab.elastic_tensor(p).displacements[held, :, 0, 1] + 0j
    else:
        network, u = jamlab.displacement_response(p, omega)
        u = u * modulus(p, omega)
    moved = np.zeros((network.n, 2), dtype=complex)
    for m in range(network.n):
        own_sites = network.particle == m
        x = network.positions[own_sites] - network.positions[own_sites].mean(axis=0)
        for part, unit in ((u.real, 1.0), (u.imag, 1j)):
            step = x + 1e-30j * part[own_sites]
            moved[m] += unit * own_centroid(*step.T).imag / 1e-30
    found = jamlab.displacement_spectrum(p, K_MAX, omega)
    assert_same(found, own_powers(p.box, network.centroids, moved))


def test_a_frequency_of_zero_is_slow_shear():
    for p, laws in ((disks("tilted"), (None, jamlab.StokesDrag())), (droplets(), (None,))):
        slow = jamlab.displacement_spectrum(p, K_MAX)
        for law in laws:
            found = jamlab.displacement_spectrum(p, K_MAX, 1e-9, law)
            assert_same(found, (slow.transverse, slow.longitudinal), 1e-6)
            assert np.abs(found.transverse / slow.transverse - 1).max() < 1e-3


def lattice(box, side):
    """A packing whose box is that of a lattice of side^2 points, and the points."""
    whole = np.array([(a, b) for a in range(side) for b in range(side)]) / side
    points = whole @ box
    return jamlab.Packing("sp", box, points, {"k": 1.0}, "k", np.full(len(points), 0.9 * np.hypot(*box[0]) / side))


@pytest.mark.parametrize("box", [6 * np.eye(2), np.array([[6.0, 0.0], [1.7, 5.0]])])
@pytest.mark.parametrize("direction", ["transverse", "longitudinal"])
def test_a_wave_has_power_in_its_direction_at_its_wavevector_alone(box, direction):
    p, amplitude = lattice(box, 6), 0.3
    waves = waves_of(p, 3.0)
    for number, k in enumerate(waves.k):
        along = k / np.hypot(*k)
        u = amplitude * (along if direction == "longitudinal" else np.array([-along[1], along[0]]))
        found = power_of(waves, p.positions, np.cos(p.positions @ k + 0.4)[:, None] * u)
        of_wave = getattr(found, direction)
        # sum of cos(k.r + a) exp(-ik.r) is n/2 of each lattice point: power a^2 n/4
        assert of_wave[number] == pytest.approx(amplitude**2 * p.n / 4, rel=1e-12)
        assert sum(map(np.sum, found)) == pytest.approx(of_wave[number], rel=1e-10)


def test_powers_on_a_lattice_sum_to_the_mean_square():
    """Parseval: over one period of the reciprocal lattice of the points, k = 0 without the mean."""
    side, rng = 5, np.random.default_rng(1)
    p = lattice(np.array([[5.0, 0.0], [2.0, 5.0]]), side)
    waves = waves_of(p, 8.0)
    zone = np.all((np.abs(waves.number) <= side // 2), axis=1)
    assert zone.sum() == (side**2 - 1) // 2
    for u in (rng.normal(size=(side**2, 2)), rng.normal(size=(side**2, 2, 2)) @ [1, 1j]):
        total = 2 * sum(power[zone].sum() for power in power_of(waves, p.positions, u))
        assert total == pytest.approx((np.abs(u - u.mean(axis=0)) ** 2).sum(), rel=1e-12)
    assert np.abs(power_of(waves, p.positions, np.ones((side**2, 2))).transverse).max() < 1e-24


def test_powers_at_short_waves_are_the_mean_square():
    """Far beyond the peaks of S(k) particles are at random phases."""
    p = disks("rattlers")
    u = jamlab.nonaffine_response(p).nonaffine
    s = jamlab.displacement_spectrum(p, 150.0)
    far = s.k > 60
    mean = (s.transverse + s.longitudinal)[far].mean()
    assert mean == pytest.approx((u**2).sum(axis=1).mean(), rel=0.05)


def test_several_packings_follow_each_other():
    packings = [jamlab.pack(16, 1e-2, seed, ensemble=STABLE) for seed in (1, 2, 3)]
    s, each = jamlab.displacement_spectrum(packings, 6.0), [jamlab.displacement_spectrum(p, 6.0) for p in packings]
    shells = s.shells([0.0, 3.0, 6.0])
    for name in ("transverse", "longitudinal"):
        values = np.concatenate([getattr(one, name) for one in each])
        assert np.array_equal(getattr(s, name), values)
        low = s.k < 3.0
        assert getattr(shells, name)[0] == pytest.approx(values[low].mean())
        means = [values[low & (s.state == n)].mean() for n in range(3)]
        assert getattr(shells, f"{name}_error")[0] == pytest.approx(np.std(means, ddof=1) / np.sqrt(3), rel=0.15)
    assert (s.packings, shells.packings) == (3, 3) and s.unit == "1/d" and s.value_unit == "d²"
    assert s.shells().wavevectors.sum() == len(s.transverse)


def test_long_waves_near_onset_are_transverse():
    found = jamlab.displacement_spectrum([jamlab.pack(128, 1e-3, seed, ensemble=STABLE) for seed in (1, 2, 3)], 1.0)
    assert found.transverse.mean() > 8 * found.longitudinal.mean()


REFUSED = {
    "infinitely slow shear knows no drag": lambda p: jamlab.displacement_spectrum(p, 5.0, damping=jamlab.StokesDrag()),
    "omega = -1": lambda p: jamlab.displacement_spectrum(p, 5.0, -1.0),
    "k_max = 0.1: the shortest wavevector": lambda p: jamlab.displacement_spectrum(p, 0.1),
    "has walls: the spectrum of displacements": lambda p: jamlab.displacement_spectrum(
        jamlab.with_walls(p, flat=True), 5.0
    ),
    r"packings\[0\] has fixed particles": lambda p: jamlab.displacement_spectrum(
        p.with_state(fixed=np.arange(p.n) < 2), 5.0
    ),
    "select: applies to a campaign": lambda p: jamlab.displacement_spectrum(p, 5.0, select={"n": 8}),
    "bins = 0": lambda p: jamlab.displacement_spectrum(p, 5.0).shells(0),
    "prestress": lambda p: jamlab.displacement_spectrum(droplets(), 5.0, prestress=False),
}


@pytest.mark.parametrize("words", REFUSED)
def test_bad_input_is_refused(words):
    with pytest.raises(jamlab.InputError, match=words):
        REFUSED[words](disks("tilted"))


def test_states_without_a_response_are_refused():
    p = disks("tilted")
    with pytest.raises(jamlab.ConvergenceError, match="unjammed"):
        jamlab.displacement_spectrum(jamlab.pack(16, phi=0.6, seed=1), 5.0)
    moved = p.positions + 1.5e-3 * np.sin(np.arange(2 * p.n)).reshape(-1, 2)
    for omega in (None, 0.1):
        with pytest.raises(jamlab.ConvergenceError, match=r"not at an energy minimum|not stable|gives way"):
            jamlab.displacement_spectrum(p.with_state(positions=moved), 5.0, omega)
