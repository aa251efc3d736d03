"""Ways to make the packings of an ensemble at a true packing fraction, from disks alone to droplets from the start."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from jamlab.engine.deck_defaults import defaults
from jamlab.errors import ConvergenceError, InputError
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.measure import measure
from jamlab.packing.packing import Packing
from jamlab.protocols.compression import compress
from jamlab.protocols.droplets_from_disks import to_polygons
from jamlab.protocols.onset import LARGEST_TOLERANCE, jam
from jamlab.protocols.size_distributions import Sizes, shown_sizes
from jamlab.statistics.published_numbers import MODELS_PART

STEP = 0.02  # of rho: means of z after steps of 0.01 and 0.02 agree within their errors
OFF_TARGET = 1e-3  # of rho: a packing that jumps farther from the packing fraction asked for is left out
ONSET = "rho-J"  # true packing fraction at jamming onset, of packings that have no rho
COLUMNS = {"z": "z", "g": "g", "b": "b", "a": "shape", "void_sides": "void_sides"}  # of `jamlab.measure`


@dataclass(frozen=True)
class EnsembleWay:
    """How a packing, or those of an ensemble, are made."""

    # "disks": compressed to the end; "carried": disks until rho or 0.88, where the models part, then droplets;
    # "droplets": from the random start on, as in Boromand et al
    start: str
    n: int  # particles of a packing
    nv: tuple[int, int] | None = None  # (small, large) number of vertices; None for disks
    contact: str | None = None  # form of the contacts of droplets; None for that of `dp.parameters`
    # largest force at a minimum, at most 1e-9 at onset; None for that of `*.minimum.parameters`
    tolerance: float | None = None

    def __str__(self) -> str:
        carried = " carried by disks" if self.start == "carried" else ""
        vertices = "disks" if self.nv is None else f"droplets{carried} with {self.nv[0]}/{self.nv[1]} vertices"
        form = f", contacts {self.contact}" if self.contact else ""
        return f"{self.n} {vertices}{form}" + (f", forces to {self.tolerance:g}" if self.tolerance else "")

    @property
    def model(self) -> str:
        """ "sp" or "dp"."""
        return "sp" if self.nv is None else "dp"

    @property
    def law(self) -> dict[str, Any]:
        """Parameters of droplets that replace those of `dp.parameters`."""
        if self.nv is None:
            return {}
        form = {"contact": self.contact} if self.contact else {}
        return {"nv_small": self.nv[0], "nv_large": self.nv[1], **form}


def refuse_sizes(sizes: Sizes | None) -> None:
    """Refuse sizes that the table of errors has not seen.

    Raises:
        InputError: sizes other than those of the decks.
    """
    if sizes is not None:
        raise InputError(
            f"sizes = {shown_sizes(sizes)}: errors were measured of two sizes alone, those of the decks; "
            "make such packings by jam, pack or a campaign, and average what you measure of them"
        )


def default_vertices() -> tuple[int, int]:
    """Read the numbers of vertices of `dp.parameters`."""
    law = defaults("dp")
    return int(law["nv_small"]), int(law["nv_large"])


def default_way(n: int) -> EnsembleWay:
    """Describe droplets with the values of `dp.parameters`, carried by disks."""
    return EnsembleWay("carried", n, default_vertices())


def find_onset(way: EnsembleWay, seed: int, **law: Any) -> Packing:
    """Make a packing at onset: disks, or droplets where these start as droplets."""
    force = None if way.tolerance is None else min(way.tolerance, LARGEST_TOLERANCE)
    if way.start != "droplets":
        return jam("sp", way.n, seed, tolerance=force, **law)
    return jam("dp", way.n, seed, tolerance=force, **way.law)


def bring_on(way: EnsembleWay, packing: Packing, rho: float, step: float = STEP) -> Packing:
    """Bring a packing, from `find_onset` or from here, to a higher rho by steps. Droplets take over from disks at rho,
    or at 0.88 where the models part, and go on from there."""

    def compressed(packing: Packing, rho: float) -> Packing:
        return _compress_to(packing, rho, step, way.tolerance)

    if packing.model == "dp" or way.nv is None:
        return compressed(packing, rho)
    if rho > MODELS_PART.value:
        return compressed(hand_over(way, compressed(packing, MODELS_PART.value)), rho)
    return hand_over(way, compressed(packing, rho))


def hand_over(way: EnsembleWay, disks: Packing) -> Packing:
    """Put droplets in the place of disks, see `to_polygons`."""
    return _require_reached(to_polygons(disks, tolerance=way.tolerance, **way.law), packing_fraction(disks))


def value_at(packing: Packing, quantity: str) -> float:
    """Measure a quantity of a packing; nan where it has none, see `values_at`."""
    return values_at(packing, (quantity,))[quantity]


def values_at(packing: Packing, quantities: tuple[str, ...]) -> dict[str, float]:
    """Measure some quantities of `COLUMNS` of a packing. a is the mean shape factor above that of a free particle, A -
    A_J; the others are those of `jamlab.measure`. All are nan in a packing that came loose."""
    row = measure(packing, {"z", *(COLUMNS[name] for name in quantities)})
    found = {name: row[COLUMNS[name]] for name in quantities}
    if "a" in found:
        counts = None if packing.offsets is None else np.diff(packing.offsets)
        found["a"] -= free_shape(None if counts is None else (int(counts.min()), int(counts.max())))
    return found if np.isfinite(row["z"]) else dict.fromkeys(quantities, float("nan"))


def free_shape(nv: tuple[int, int] | None) -> float:
    """Mean shape factor of free particles, (nv/pi) tan(pi/nv) of regular polygons; half of the particles are large."""
    if nv is None:
        return 1.0
    counts = np.array(nv)
    return float((counts * np.tan(np.pi / counts) / np.pi).mean())


def _compress_to(packing: Packing, rho: float, step: float, tolerance: float | None) -> Packing:
    reached = packing_fraction(packing)
    if reached >= rho + OFF_TARGET * (packing.model == "dp"):
        raise ConvergenceError(f"the packing jams at rho = {reached:.5f}, above the {rho:g} asked for")
    if reached >= rho - 1e-6:
        return packing
    for state in compress(packing, rho, step, tolerance=tolerance):
        packing = _require_reached(state, None)
    return _require_reached(packing, rho)


def _require_reached(packing: Packing, rho: float | None) -> Packing:
    if not packing.converged:
        raise ConvergenceError(f"{packing.model} state at phi = {packing.phi:.4f} did not converge")
    if rho is not None and abs(packing_fraction(packing) - rho) > OFF_TARGET:
        raise ConvergenceError(f"the packing jumps from rho = {rho:.4f} to {packing_fraction(packing):.4f}")
    return packing
