"""G*(omega) of droplets by three solvers, with drag between vertices that touch and with drag of the fluid."""

from collections.abc import Iterator

from jamlab.estimates.ensemble_way import bring_on, default_way
from jamlab.protocols.onset import jam
from jamlab.rheology.damping import ContactDamping, StokesDrag
from jamlab.studies.cost import spectra
from jamlab.studies.cost.topic import Topic, Trial

_N, _RHO = 8, 0.92


def measure(seed: int) -> Iterator[Trial]:
    """Measure one packing with both drag laws."""
    droplets = bring_on(default_way(_N), jam("sp", _N, seed), _RHO)
    yield from spectra.measure_packing("contact damping", droplets, ContactDamping())
    yield from spectra.measure_packing("Stokes drag", droplets, StokesDrag())


TOPIC = Topic(
    f"Complex shear modulus of {_N} droplets at ρ = {_RHO}, 31 frequencies over ten decades",
    spectra.TOPIC.error,
    spectra.TOPIC.dial,
    spectra.TOPIC.reference,
    measure,
)
