"""Transient radii: the energy that is relaxed, the same sizes, lower energies."""

import numpy as np
import pytest

import jamlab
from jamlab.protocols.relax_radii import radii_energy

WIDE = "lognormal:0.2"


@pytest.fixture(scope="module")
def quenched():
    return jamlab.pack(n=32, phi=0.9, seed=1, sizes=WIDE)


def of_law(p, **law):
    return jamlab.Packing("sp", p.box, p.positions, law, "eps", p.diameters)


PACKINGS = {
    "k": lambda p: p,
    "eps": lambda p: of_law(p, eps=1.3),
    "Hertz": lambda p: of_law(p, eps=1.3, exponent=2.5),
    "sticky": lambda p: jamlab.pack(n=16, phi=0.8, seed=1, sizes=WIDE, law={"stickiness": 0.05}),
    "own images": lambda p: jamlab.pack(n=2, phi=1.2, seed=1, sizes=[1.0, 1.3]),
    "flat walls": lambda p: jamlab.relax(jamlab.with_walls(p, flat=True)),
    "fixed": lambda p: p.with_state(fixed=np.arange(32) < 5),
}


@pytest.mark.parametrize("name", PACKINGS)
def test_energy_and_its_derivatives(name, quenched):
    p = PACKINGS[name](quenched)
    free = p.frame.free
    energy = radii_energy(p, 0.1)
    start = np.append(p.positions[free].ravel(), np.zeros(free.sum()))
    assert energy(start)[0] == pytest.approx(jamlab.evaluate(p).energy, rel=1e-9)  # radii are where they were
    random = np.random.default_rng(1)
    state = start + 0.02 * random.standard_normal(len(start))
    way, step = random.standard_normal(len(start)), 1e-6
    slope = (energy(state + step * way)[0] - energy(state - step * way)[0]) / (2 * step)
    assert energy(state)[1] @ way == pytest.approx(slope, rel=1e-6)


def test_sizes_are_the_same_and_energies_lower():
    for seed in (1, 2):
        p = jamlab.pack(n=16, phi=0.9, seed=seed, sizes=WIDE)
        q = jamlab.relax_radii(p)
        assert np.array_equal(np.sort(q.diameters), np.sort(p.diameters)) and q.phi == p.phi and q.converged
        assert jamlab.evaluate(q).energy < 0.8 * jamlab.evaluate(p).energy
        assert seed > 1 or jamlab.make(q.recipe) == q
        assert q.phi_J is None and q.provenance["resized"] > 0.3


def test_stiff_radii_stay(quenched):
    q = jamlab.relax_radii(quenched, 1e3)
    assert np.array_equal(q.diameters, quenched.diameters) and q.provenance["resized"] == 0
    assert jamlab.evaluate(q).energy == pytest.approx(jamlab.evaluate(quenched).energy, rel=1e-9)


def test_fixed_disks_keep_place_and_size(quenched):
    p = PACKINGS["fixed"](quenched)
    q = jamlab.relax_radii(p)
    assert np.array_equal(q.diameters[:5], p.diameters[:5]) and not np.array_equal(q.diameters, p.diameters)
    assert np.allclose(q.positions[:5], p.positions[:5], rtol=0, atol=1e-13)


def test_few_disks_sticky_ones_and_a_pressure(quenched):
    one = jamlab.Packing("sp", [[0.9, 0], [0.2, 0.9]], [[0.1, 0.2]], {"k": 1.0}, "k", [1.0])
    for p in (one, PACKINGS["own images"](quenched), jamlab.pack(n=16, phi=0.85, seed=1, sizes="monodisperse")):
        q = jamlab.relax_radii(p)
        assert np.array_equal(np.sort(q.diameters), np.sort(p.diameters)) and q.converged
    sticky = PACKINGS["sticky"](quenched)
    assert jamlab.evaluate(jamlab.relax_radii(sticky)).energy < jamlab.evaluate(sticky).energy
    q = jamlab.relax_radii(quenched, 0.1, pressure=1e-2)
    assert jamlab.evaluate(q).pressure == pytest.approx(1e-2, rel=1e-6)


@pytest.mark.parametrize(
    "given, words",
    [
        (dict(radius_stiffness=0.0), "radius_stiffness = 0"),
        (dict(radius_stiffness=-1.0), "radius_stiffness = -1"),
        (dict(radius_stiffness=float("nan")), "radius_stiffness"),
        (dict(pressure=0.0), "pressure = 0"),
        (dict(force_tolerance=-1e-12), "force_tolerance"),
    ],
)
def test_wrong_arguments_are_named(quenched, given, words):
    with pytest.raises(jamlab.InputError, match=words):
        jamlab.relax_radii(quenched, **given)
