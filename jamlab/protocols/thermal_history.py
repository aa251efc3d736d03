"""What swap Monte Carlo and thermal annealing have in common: temperatures, what is recorded of them, and the quench at
the end.

A temperature is k_B T over the energy of contacts: eps, or k d^2 with the mean size d.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import check_number
from jamlab.engine.session import Session
from jamlab.errors import InputError
from jamlab.packing.natural_units import mean_size, natural_scales, stiffness_scale
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.plotting.drawable import LEGEND, drawn, label_axes, merged_line, positive
from jamlab.plotting.palette import BLUE, RED
from jamlab.protocols.box_relaxation import Ensemble
from jamlab.protocols.decompression import check_met
from jamlab.protocols.saddles import record, relax_off_saddles
from jamlab.storage.verified_file import versions

Temperature = float | Sequence[float] | Array
HOTTEST = 1.0  # contacts alone hold particles apart: beyond, they pass through each other all the time
STRETCHES = 50  # rows of a history at most, each at one temperature
_KEPT = ("seed", "source", "sizes")  # of a provenance: the seed of the random start


@dataclass(frozen=True, eq=False)
class ThermalHistory(Result):
    """A packing and how it was annealed: m stretches, each at one temperature.

    Attributes:
        packing: the minimum at the end.
        temperature: (m,) k_B T over the energy of contacts.
        energy: (m,) mean potential energy a particle during the stretch, over the energy of contacts.
    """

    _along: ClassVar[str] = ""  # the field that counts how long it took, and its label
    _along_label: ClassVar[str] = ""

    packing: Packing
    temperature: Array
    energy: Array

    @drawn('Line2D, such as color="k"')
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw potential energy a particle and temperature, both over the energy of contacts."""
        along = getattr(self, self._along)
        energy, left_out = positive(self.energy)
        plain = {"color": BLUE, "linewidth": 1.4, "label": f"energy a particle{left_out}"}
        axes.plot(along, energy, **merged_line(plain, style))
        axes.plot(along, self.temperature, color=RED, linewidth=1.0, linestyle="--", label="temperature")
        axes.set_yscale("log")
        label_axes(axes, self._along_label, "energy over energy of a contact")
        axes.legend(fontsize=LEGEND, title=self._said(), title_fontsize=LEGEND)

    def _said(self) -> str:
        """Title of the legend."""
        return ""


def check_temperature(temperature: Temperature) -> Array:
    """(k,) temperatures, refused where one is none."""
    values = np.atleast_1d(np.asarray(temperature, dtype=np.float64))
    if values.ndim != 1 or not len(values):
        raise InputError(
            f"temperature {values.shape}: give a number, or one for each end of a stretch, from hot to cold"
        )
    for value in values.tolist():
        check_number("temperature", value, HOTTEST)
    return values


def temperatures(given: Array, stretches: int) -> Array:
    """(stretches,) temperatures of stretches of equal length, by equal factors from each given one to the next."""
    places = np.linspace(0, len(given) - 1, stretches)
    return np.asarray(np.exp(np.interp(places, np.arange(len(given)), np.log(given))))


def contact_energy(packing: Packing) -> float:
    """Energy of contacts: eps, or k d^2."""
    return stiffness_scale(packing) * mean_size(packing) ** 2


def quenched(
    given: Packing, hot: Packing, tolerance: float | None, pressure: float | None, began: float, **entries: Any
) -> Packing:
    """The minimum next to a state, in the ensemble and the units of the packing that was given, and at a pressure if
    one is given. It has no `phi_J`: its onset is another one than the onset of the given packing. `began`: see
    `time.perf_counter`."""
    scales = natural_scales(given)
    held = None if pressure is None else pressure / scales.stress
    with Session(scales.to_natural(hot)) as session:
        ensemble = Ensemble(may_shear=given.ensemble == "shear-stabilized", pressure=held)
        found = relax_off_saddles(session, tolerance, ensemble=ensemble)
        packing = session.packing(phi_J=None, rounding=0.0)
        if held is not None:
            check_met(packing, found, held, "use another pressure, or give none and go on by jamlab.decompress")
        ended = record(session, packing, found)
    kept = {name: value for name, value in given.provenance.items() if name in _KEPT}
    known = {"wall_time": time.perf_counter() - began, **versions()}
    return scales.from_natural(ended)._trusted(provenance={**kept, **entries, **known})
