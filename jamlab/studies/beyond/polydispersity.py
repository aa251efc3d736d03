"""A study of what the sizes of disks and droplets change: onset, and contacts, G and G* at one distance above it."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar

from jamlab.errors import ConvergenceError
from jamlab.geometry.contact_network import contacts
from jamlab.protocols.compression import compress
from jamlab.protocols.moduli import shear_modulus
from jamlab.protocols.onset import jam
from jamlab.rheology.complex_modulus import complex_modulus
from jamlab.studies.study import Shown, TableStudy
from jamlab.studies.table import MeasuredTable, Task

DISTANCE = 0.01  # above the onset of each packing, in phi
OMEGA = (1e-3, 1e-2, 1e-1, 1.0)
PARTICLES = {"sp": 128, "dp": 32}
SEEDS, BLOCK = 20, 10  # packings of a distribution, and of one task
_MIXED = {"sp": ((1.4, 2.0, 4.0), (0.1, 0.25, 0.5, 0.8)), "dp": ((1.4, 2.0), (0.25, 0.5, 0.75))}
_WIDTHS = {"sp": (0.1, 0.2, 0.3, 0.5, 0.7), "dp": (0.1, 0.2, 0.3, 0.5)}


def measure_sizes(model: str, sizes: str, first: int) -> list[dict[str, Any]]:
    """Measure packings of one distribution: phi_J, and z, G and G* at `DISTANCE` above, nan where none is held."""
    seeds = range(first, first + BLOCK)
    return [{"model": model, "sizes": sizes, "seed": seed, **_measure(model, sizes, seed)} for seed in seeds]


def _measure(model: str, sizes: str, seed: int) -> dict[str, Any]:
    found: dict[str, Any] = {}
    try:
        onset = jam(model, PARTICLES[model], seed, sizes=sizes)
        found |= {"phi_J": onset.phi, "rattlers": float(contacts(onset).rattlers.mean())}
        *_, state = compress(onset, onset.phi + DISTANCE, 0.25 * DISTANCE, by="phi")
        spectrum = complex_modulus(state, OMEGA)
        return found | {
            "z": contacts(state).z,
            "g": float(shear_modulus(state, average=True)),
            **{f"storage_{w:g}": float(s) for w, s in zip(OMEGA, spectrum.storage, strict=True)},
            **{f"loss_{w:g}": float(s) for w, s in zip(OMEGA, spectrum.loss, strict=True)},
        }
    except ConvergenceError as error:
        return found | {"note": str(error)}


@dataclass(frozen=True)
class Polydispersity(TableStudy):
    """Onset of disks and droplets against ratio, mixing and width, and what is left of it in z, G and G*."""

    columns: ClassVar = (
        *("model", "sizes", "seed", "phi_J", "rattlers", "z", "g"),
        *(f"{part}_{w:g}" for part in ("storage", "loss") for w in OMEGA),
        "note",
    )
    task: ClassVar[str] = "distribution"

    def tasks(self) -> Mapping[str, Task]:
        """Some packings of each model and distribution."""
        named = []
        for model, (ratios, shares) in _MIXED.items():
            named += [(model, f"bidisperse:{ratio:g},{share:g}") for ratio in ratios for share in shares]
        named += [(model, "monodisperse") for model in PARTICLES]
        named += [(model, f"lognormal:{width:g}") for model, widths in _WIDTHS.items() for width in widths]
        return {
            f"{model} {sizes} {first}": partial(measure_sizes, model, sizes, first)
            for first in range(1, SEEDS + 1, BLOCK)
            for model, sizes in named
        }

    def show(self, table: MeasuredTable) -> Shown:
        """Draw the table."""
        return Shown()


STUDY = Polydispersity(
    "polydispersity", "What sizes change: onset, contacts and moduli against ratio, mixing and width"
)
