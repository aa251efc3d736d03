"""Figures of flow in time beside stored ones, pixel by pixel, from tables in which known laws hold."""

from functools import cache

import flow_tables
import pytest
from bare_pictures import bare, picture

from jamlab.studies import gallery
from jamlab.studies.ensemble_tables import EnsembleTables

pytestmark = pytest.mark.slow


@cache
def tables():
    made = {name: make() for name, make in flow_tables.TABLES.items()}
    return EnsembleTables(made.__getitem__)


def drawn(name, columns=3):
    return bare(gallery.draw(f"dynamics-{name}", tables()).figure, columns=columns)


@picture
def test_flow_curves():
    """Curves from dark to light, their means over pressure, and the law with a yield stress through one of them."""
    return drawn("flow-curves")


@picture
def test_collapse():
    """One line through onset, and its two branches."""
    critical = EnsembleTables(lambda name: flow_tables.flow(critical=True))
    return bare(gallery.draw("dynamics-collapse", critical).figure, columns=2)


@picture
def test_overshoot():
    """Peaks above dotted steady stresses, their excess, their strain."""
    return drawn("overshoot")


@picture
def test_yield():
    """Flow curve with law, band and peaks; share that flows; six ways with bars."""
    return drawn("yield")


@picture
def test_amplitudes():
    """Storage filled, loss dashed, at three frequencies; softening and yielding over pressure."""
    return drawn("amplitudes", columns=4)


@picture
def test_power_law():
    """Three drag laws, their ratio to the linear one, and checks, with a grey band."""
    return drawn("power-law")


@picture
def test_equivalent_damping():
    """A map of squares with numbers, and errors over reduced frequency, with a grey band."""
    return drawn("equivalent-damping")


@picture
def test_droplets():
    """Droplets and disks at two packing fractions, and their pressure."""
    return drawn("droplets")
