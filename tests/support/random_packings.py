"""Packings for property tests: any box, disks that overlap as they like, random simple polygons."""

import numpy as np
from hypothesis import strategies as st

from jamlab.laws.rim import CONTACT_FORMS
from jamlab.packing.packing import Packing

numbers = st.floats(0.1, 10.0)
seeds = st.integers(0, 2**32 - 1)


@st.composite
def boxes(draw, side=1.0):
    """A parallelogram of area side^2, tilted by up to 1.5 of its width."""
    stretch = draw(st.floats(0.7, 1.4))
    tilt = draw(st.sampled_from([0.0, 0.3, -0.5, 1.0]) | st.floats(-1.5, 1.5))
    return side * np.array([[stretch, 0.0], [tilt * stretch, 1 / stretch]])


@st.composite
def disks(draw, most=12):
    """Disks anywhere, some outside the box, in either unit system."""
    n, rng = draw(st.integers(1, most)), np.random.default_rng(draw(seeds))
    diameters = rng.choice([0.7, 1.0, 1.4], n)
    box = draw(boxes(np.sqrt(np.pi / 4 * np.sum(diameters**2) / draw(st.floats(0.3, 1.3)))))
    units = draw(st.sampled_from(["eps", "k"]))
    return Packing("sp", box, rng.uniform(-1, 2, (n, 2)) @ box, {units: draw(numbers)}, units, diameters)


@st.composite
def polygons(draw, contact=None, most=4, reach=(0.3, 0.47)):
    """Star-shaped polygons of 3 to 8 vertices on a lattice of places: rims overlap, outlines do not cross."""
    rows, rng = draw(st.integers(1, most // 2)), np.random.default_rng(draw(seeds))
    sizes = rng.integers(3, 9, 2 * rows)
    places = np.stack(np.meshgrid([0.25, 0.75], (np.arange(rows) + 0.5) / rows), axis=-1).reshape(-1, 2)
    box = np.array([[2.0, 0.0], [draw(st.floats(-2.0, 2.0)), float(rows)]])
    rings = []
    for place, size in zip(places @ box, sizes, strict=True):
        turn = 2 * np.pi * (np.arange(size) + rng.uniform(-0.35, 0.35, size)) / size + rng.uniform(0, 2 * np.pi)
        rings.append(place + rng.uniform(*reach, (size, 1)) * np.column_stack([np.cos(turn), np.sin(turn)]))
    form = contact or draw(st.sampled_from(CONTACT_FORMS))
    # up to gamma/ka = 0.02 triangles of a0 = 0.2 have a free area, and so a phi
    law = {
        "gamma": draw(numbers),
        "ka": draw(st.floats(500.0, 5000.0)),
        "eps": draw(numbers),
        "delta": draw(st.floats(0.1, 0.4)),
    }
    law |= {"eta": draw(st.sampled_from([0.0, 0.1])), "contact": form, "a0": rng.uniform(0.2, 1.0, len(sizes))}
    return Packing("dp", box, np.concatenate(rings), law, offsets=np.cumsum([0, *sizes]))


def packings():
    """Of either model."""
    return disks() | polygons()
