"""Random packings, not at rest, that leave their box on all sides: for readers and writers."""

import numpy as np

from jamlab.laws.rim import CONTACT_FORMS
from jamlab.packing.packing import Packing


def disks(seed, tilt, units="eps", n=12):
    rng = np.random.default_rng(seed)
    box = np.array([[10 / 3, 0.0], [tilt, 29 / 9.9]])
    positions = rng.uniform(-2, 3, (n, 2)) @ box
    sizes = rng.choice([0.7, 1.0, 1.4], n) / 3
    law, more = {units: rng.uniform(0.1, 2)}, {"phi_J": 0.8 + rng.random() / 9, "max_force": 1 / 3e9}
    return Packing("sp", box, positions, law, units, sizes, **more)


def polygons(seed, tilt):
    """Jagged polygons smaller than half the box, none of which crosses itself; they may lie on each other."""
    rng = np.random.default_rng(seed)
    box = np.array([[10 / 3, 0.0], [tilt, 29 / 9.9]])
    counts = rng.integers(3, 9, 5)
    centres = rng.uniform(-2, 3, (5, 2)) @ box
    rings = []
    for centre, count in zip(centres, counts, strict=True):
        angle = 2 * np.pi * (np.arange(count) + rng.uniform(-0.2, 0.2, count) + rng.random()) / count
        reach = rng.uniform(0.3, 0.4, count)
        rings.append(centre + reach[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]))
    law = dict(zip(("gamma", "ka", "eps", "delta", "eta"), rng.uniform(0.1, 0.3, 5).tolist(), strict=True))
    params = law | {"ka": 300 * law["ka"], "contact": CONTACT_FORMS[seed % 3], "a0": rng.choice([1 / 3, 0.5], 5)}
    more = {"offsets": np.cumsum([0, *counts]), "ensemble": "shear-stabilized"}
    return Packing("dp", box, np.concatenate(rings), params, **more)


def assert_same(read, written, digits):
    """Same particles and law, same place to so many digits of the largest coordinate."""
    assert read.difference(written) is None
    for name in ("phi_J", "ensemble"):
        assert getattr(read, name) == getattr(written, name)
    near = 10.0**-digits * max(np.abs(written.positions).max(), np.abs(written.box).sum())
    np.testing.assert_allclose(read.positions, written.positions, rtol=0, atol=near)
    np.testing.assert_allclose(read.box, written.box, rtol=0, atol=near)
