"""Random packings turned, mirrored, relabelled, moved and scaled: every result transforms as it must, to 1e-9."""

import dataclasses

import numpy as np
import pytest

import jamlab
from jamlab.mechanics.stiffness import stress

OMEGA = np.logspace(-4, 2, 7)
DIGITS = 1e-9
ANGLES = np.array([0.0, 0.3, 1.0])
TURN = np.array([[0.0, 1.0], [-1.0, 0.0]])  # by 90 degrees, counter-clockwise, for rows

MODELS = ("sp", "dp")
SEEDS = [1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 21))]


@pytest.fixture(scope="module", params=SEEDS)
def seed(request):
    return request.param


@pytest.fixture(scope="module", params=MODELS)
def packing(request, seed):
    """Well above onset, so that contacts keep their digits when positions are rounded anew."""
    if request.param == "sp":
        return jamlab.pack(n=16, pressure=1e-2, seed=seed)
    *_, last = jamlab.compress(jamlab.jam(model="dp", n=6, seed=seed), to=0.92, step=0.03)
    return last


@pytest.fixture(scope="module")
def original(packing):
    return Results(packing)


class Results:
    """All that has to transform."""

    def __init__(self, packing):
        self.packing = packing
        voids = jamlab.voids(packing)
        order = np.argsort(voids.area)
        self.same = {
            "z": jamlab.contacts(packing).z,
            "rho": jamlab.packing_fraction(packing),
            "sides of voids": np.sort(voids.sides),
            "areas of voids": voids.area[order] / packing.area,
            "shapes of voids": np.sort(voids.shape),
        }
        self.bulk = jamlab.bulk_modulus(packing)
        self.stress = stress(packing)
        self.spectrum = jamlab.complex_modulus(packing, OMEGA, jamlab.ContactDamping(arms="contact"), method="dense")

    def shear(self, angles):
        return jamlab.shear_modulus(self.packing, angle=angles)


def compare(packing, original, *, angles=ANGLES, unit=1.0, storage=0.0):
    """Results of a transformed packing in a unit of stress, with the angles that ANGLES become and what G' gains."""
    now, before = Results(packing), original
    for name, value in before.same.items():
        np.testing.assert_allclose(now.same[name], value, rtol=DIGITS, atol=1e-14, err_msg=name)
    size = before.bulk * unit
    assert now.bulk == pytest.approx(size, rel=DIGITS)
    np.testing.assert_allclose(now.shear(angles), before.shear(ANGLES) * unit, rtol=0, atol=DIGITS * size)
    for got, wanted in (
        (now.spectrum.loss, before.spectrum.loss * unit),
        (now.spectrum.storage, before.spectrum.storage * unit + storage),
    ):
        np.testing.assert_allclose(got, wanted, rtol=DIGITS, atol=0.1 * DIGITS * size)  # soft modes amplify rounding


def test_a_quarter_turn_moves_directions(packing, original):
    """G' of shear along x becomes that along y, which differs by the difference of the normal stresses."""
    width, height = np.diag(packing.box)
    turned = dataclasses.replace(packing, positions=packing.positions @ TURN, box=np.diag([height, width]))
    s = original.stress
    compare(turned, original, angles=ANGLES + np.pi / 2, storage=s[1, 1] - s[0, 0])
    assert abs(s[1, 1] - s[0, 0]) > 1e-4 * original.bulk  # else the shift of G' would not be tested


def test_a_mirror_changes_nothing(packing, original):
    """x -> -x; polygons run the other way round."""
    mirrored = packing.positions * [-1, 1]
    if packing.model == "dp":
        mirrored = np.concatenate([ring[::-1] for ring in np.split(mirrored, packing.offsets[1:-1])])
    compare(dataclasses.replace(packing, positions=mirrored), original, angles=np.pi - ANGLES)


def test_labels_change_nothing(packing, original):
    """Particles in another order, polygons that start at another vertex."""
    rng = np.random.default_rng(0)
    order = rng.permutation(packing.n)
    if packing.model == "sp":
        other = dataclasses.replace(packing, positions=packing.positions[order], diameters=packing.diameters[order])
    else:
        rings = np.split(packing.positions, packing.offsets[1:-1])
        rings = [np.roll(rings[m], rng.integers(len(rings[m])), axis=0) for m in order]
        params, offsets = packing.params | {"a0": packing.params["a0"][order]}, np.cumsum([0, *map(len, rings)])
        other = dataclasses.replace(packing, positions=np.concatenate(rings), offsets=offsets, params=params)
    compare(other, original)
    one, two = (jamlab.complex_modulus(p, [1.0]) for p in (packing, other))
    assert abs(one.eta_inf - two.eta_inf) <= one.eta_inf_error + two.eta_inf_error
    assert one.eta_inf_error < 0.1 * one.eta_inf or one.eta_inf == 0


def test_images_change_nothing(packing, original):
    """Every particle moved by lattice vectors of its own, and all by one vector."""
    images = np.random.default_rng(0).integers(-2, 3, (packing.n, 2)) @ packing.box
    moved = packing.positions + images[packing.particle] + [0.37, -4.1]
    compare(dataclasses.replace(packing, positions=moved), original)


def test_lengths_scale(packing, original):
    """By 1e3: k keeps disks in units "k" as stiff as they were; energies keep stresses times areas."""
    scale = 1e3
    # powers of length in the parameters: energies, eps, stay
    powers = {"gamma": -1, "ka": -4, "delta": 1, "eta": 1, "a0": 2}
    params = {name: value * scale ** powers.get(name, 0) for name, value in packing.params.items() if name != "contact"}
    params = packing.params | params
    names = ("box", "positions", "diameters") if packing.model == "sp" else ("box", "positions")
    scaled = dataclasses.replace(packing, **{name: scale * getattr(packing, name) for name in names}, params=params)
    compare(scaled, original, unit=1.0 if packing.units == "k" else scale**-2)
