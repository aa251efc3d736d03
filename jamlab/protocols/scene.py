"""A scene: particles at a true packing fraction, modelled as simply as the tolerances allow."""

import time
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from jamlab.checks import check_choice, checked
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import ConvergenceError
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.measure import measure
from jamlab.packing.law_parameters import MODELS
from jamlab.packing.packing import Packing
from jamlab.packing.short_repr import short_repr
from jamlab.protocols.compression import compress
from jamlab.protocols.droplets_from_disks import to_polygons
from jamlab.protocols.model_choice import Choice, Way, choose
from jamlab.protocols.onset import jam
from jamlab.statistics.published_numbers import MODELS_PART

STEP = 0.02  # of rho: the chart of steps shows no gain in z from smaller ones


@dataclass(frozen=True)
class Scene:
    """Outcome of `scene`.

    Attributes:
        packing: at the packing fraction asked for; its provenance holds the choice.
        values: every quantity that a tolerance can be asked for, see `model_choice.QUANTITIES`, of the packing.
        estimate: the same for default droplets: values with the choice's corrections, to which its errors apply.
        choice: model, contact form and vertices, expected error, and why.
        seconds: wall time.

    Example:
        >>> s = jamlab.scene(rho=0.87, n=16, seed=1, tolerance={"z": 0.5})
        >>> sorted(s.values), round(s.estimate["z"] - s.values["z"] - s.choice.correction["z"], 12)
        (['a', 'g', 'void_sides', 'z'], 0.0)
    """

    packing: Packing
    values: dict[str, float]
    estimate: dict[str, float]
    choice: Choice
    seconds: float

    __repr__ = short_repr


@checked
def scene(
    rho: float,
    n: int = 64,
    seed: int = 1,
    *,
    tolerance: Mapping[str, float],
    model: str = "auto",
    step: float = STEP,
) -> Scene:
    """Make particles at rho by the cheapest model expected to keep every tolerance.

    Disks are jammed and compressed; where droplets are needed, they take over from the disks at rho, or at 0.88 where
    the models part, and go on from there.

    Args:
        rho: true packing fraction.
        n: even number of particles.
        seed: of the random start.
        tolerance: what is wanted -> error allowed, e.g. {"z": 0.05}.
        model: "auto", "sp" or "dp".
        step: of rho in the sweeps.

    Raises:
        InputError: see `jamlab.protocols.model_choice.choose`.
        ConvergenceError: no onset below rho, or a state on the way did not converge.

    Example:
        >>> s = jamlab.scene(rho=0.87, n=16, seed=1, tolerance={"z": 0.5})
        >>> s.choice.way.model, s.packing.n
        ('sp', 16)
    """
    began = time.perf_counter()
    choice = choose(rho, tolerance, n, model=model)
    packing = bring_to(choice.way, jam("sp", n, seed), rho, step)
    entries = {"model_choice": str(choice.way), "model_why": choice.why, "model_warning": choice.warning}
    packing = packing.with_state(provenance=entries)
    values = quantities(packing)
    estimate = {name: value + choice.correction[name] for name, value in values.items()}
    return Scene(packing, values, estimate, choice, time.perf_counter() - began)


def bring_to(way: Way, onset: Packing, rho: float, step: float = STEP) -> Packing:
    """Bring disks at onset to rho in a given way.

    Raises:
        ConvergenceError: rho is below the onset, or a state did not converge.
    """
    check_choice("model", way.model, MODELS)
    if packing_fraction(onset) >= rho:
        raise ConvergenceError(f"the packing jams at rho = {packing_fraction(onset):.5f}, above the {rho:g} asked for")
    packing = _compress_to(onset, rho if way.nv is None else min(rho, MODELS_PART.value), step)
    if way.nv is not None:
        small, large = way.nv
        packing = _require_converged(to_polygons(packing, contact=way.contact, nv_small=small, nv_large=large))
        if rho > MODELS_PART.value:  # up to here disks carry the droplets
            packing = _compress_to(packing, rho, step)
    return packing


def quantities(packing: Packing) -> dict[str, float]:
    """z, g, a and void_sides of a packing, see `model_choice.QUANTITIES`; nan where one is not defined."""
    row = measure(packing)
    free = 1.0
    if packing.offsets is not None:
        nv = np.diff(packing.offsets)
        free = float((nv * np.tan(np.pi / nv) / np.pi).mean())
    return {"z": row["z"], "g": row["g"], "a": row["shape"] - free, "void_sides": row["void_sides"]}


def default_way() -> Way:
    """Describe droplets with the values of `dp.parameters`."""
    law = defaults("dp")
    return Way("dp", str(law["contact"]), (int(law["nv_small"]), int(law["nv_large"])))


def _compress_to(packing: Packing, rho: float, step: float) -> Packing:
    for state in compress(packing, rho, step):
        packing = _require_converged(state)
    return packing


def _require_converged(packing: Packing) -> Packing:
    if not packing.converged:
        left = float("nan") if packing.max_force is None else packing.max_force
        raise ConvergenceError(
            f"{packing.model} state at phi = {packing.phi:.4f} did not converge: max force {left:.2g} is left"
        )
    return packing
