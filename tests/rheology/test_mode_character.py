"""Motion of droplets in relaxation modes: parts that are known, sums that must hold, and what carries no drag."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import jamlab
from jamlab.errors import InputError
from jamlab.rheology.mode_character import MOTIONS, motion_shares


@cache
def dense():
    """Eight droplets at a true packing fraction of 0.92."""
    return jamlab.read(Path(__file__).parents[1] / "states" / "stable_droplets.h5")


def ring(displacement, n=12, radius=1.0):
    """Shares of four displacements of the vertices of a regular polygon beside one at rest."""
    angle = 2 * np.pi * np.arange(n) / n
    circle = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    law = {"gamma": 0.1, "ka": 10.0, "eps": 1.0, "delta": 0.2, "eta": 0.0, "contact": "outline", "a0": np.full(2, 3.0)}
    places = np.concatenate([circle, circle + np.array([5.0, 0.0])])
    p = jamlab.Packing("dp", 20 * np.eye(2), places, law, offsets=np.array([0, n, 2 * n]))
    u = np.zeros((2 * n, 2, 1))
    u[:n, :, 0] = displacement(circle)
    return [float(share[0]) for share in motion_shares(p, u)]


def test_pure_motions_of_a_regular_polygon():
    turned = lambda x: np.column_stack([-x[:, 1], x[:, 0]])  # noqa: E731
    assert ring(lambda x: np.tile([0.3, -2.0], (len(x), 1))) == pytest.approx([1, 0, 0, 0])
    assert ring(turned) == pytest.approx([0, 1, 0, 0])
    assert ring(lambda x: x * (2 * x[:, :1] ** 2 - 1)) == pytest.approx([0, 0, 0, 1])
    assert ring(lambda x: turned(x) * (2 * x[:, :1] ** 2 - 1)) == pytest.approx([0, 0, 1, 0])
    assert ring(lambda x: x * [1, 2] + 3 * turned(x)) == pytest.approx([0, 0.75, 0.25 / 36, 0.25 - 0.25 / 36], abs=0.2)


def test_rotation_weighs_as_much_as_the_displacements_that_it_makes():
    """Twice the radius turned by one: vertices move by two, as far as in a translation by two."""
    turned_and_moved = lambda x: np.column_stack([-x[:, 1] + 2.0, x[:, 0]])  # noqa: E731
    assert ring(turned_and_moved, radius=2.0) == pytest.approx([0.5, 0.5, 0, 0])


@pytest.mark.parametrize("law", [jamlab.ContactDamping(0.5), jamlab.StokesDrag(1.0)])
def test_strengths_make_up_the_modulus_and_shares_one(law):
    m, omega = jamlab.mode_character(dense(), law), np.geomspace(1e-3, 1e2, 4)
    s = jamlab.complex_modulus(dense(), omega, law, method="dense")
    part = omega[:, None] ** 2 / (m.rates**2 + omega[:, None] ** 2)
    assert s.g0 + part @ m.strengths == pytest.approx(s.storage, rel=1e-9)
    shares = np.array([getattr(m, name) for name in MOTIONS])
    assert shares.sum(axis=0) == pytest.approx(1.0) and shares.min() > -1e-12
    assert sum(m.share(name, fastest=1.0) for name in MOTIONS) == pytest.approx(1.0)
    assert np.isnan(m.share("across", slowest=1e30))


def test_what_dissipates_in_slow_and_in_fast_modes():
    """Without drag on sliding none dissipates so; with it, the slow relaxation does nothing else."""
    free, rubbing = (jamlab.mode_character(dense(), jamlab.ContactDamping(beta)) for beta in (0.0, 1.0))
    assert free.sliding == pytest.approx(0.0, abs=1e-9)
    assert rubbing.share("sliding", fastest=1e-2) > 0.99 and rubbing.share("sliding", slowest=1.0) < 0.9
    assert np.isnan(jamlab.mode_character(dense(), jamlab.StokesDrag(1.0)).sliding).all()


def test_refusals():
    with pytest.raises(InputError):
        jamlab.mode_character(jamlab.pack(16, 1e-2, 1))
    with pytest.raises(InputError, match="'shape'"):
        jamlab.mode_character(dense()).share("shape")
