"""A scene: particles at a true packing fraction, modelled as simply as the tolerances allow."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.estimates.ensemble_way import STEP, bring_on, find_onset, refuse_sizes, values_at
from jamlab.estimates.model_choice import QUANTITIES, Choice, choose
from jamlab.packing.packing import Packing
from jamlab.packing.short_repr import short_repr
from jamlab.protocols.size_distributions import Sizes


@dataclass(frozen=True)
class Scene:
    """Outcome of `scene`.

    Attributes:
        packing: at the packing fraction asked for; its provenance holds the choice.
        values: every quantity that a tolerance can be asked for, see `model_choice.QUANTITIES`, of the packing.
        estimate: the same for default droplets: values with the choice's corrections, to which its errors apply.
        choice: model, contact form and vertices, expected error, and what else there was.
        seconds: wall time.

    Example:
        >>> s = jamlab.scene(rho=0.87, n=16, seed=1, tolerance={"z": 0.5})
        >>> sorted(s.values), abs(round(s.estimate["z"] - s.values["z"] - s.choice.correction["z"], 12))
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
    exponent: float | None = None,
    sizes: Sizes | None = None,
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
        exponent: of the energy of disks, see `jam`; above 2 with model = "sp" alone. Errors and corrections of the
            choice are those of harmonic disks.
        sizes: refused: the errors are those of two sizes, half and half.

    Raises:
        InputError: see `jamlab.estimates.model_choice.choose`.
        ConvergenceError: no onset below rho, or a state on the way did not converge.

    Example:
        >>> s = jamlab.scene(rho=0.87, n=16, seed=1, tolerance={"z": 0.5})
        >>> s.choice.way.model, s.packing.n
        ('sp', 16)
    """
    began = time.perf_counter()
    refuse_sizes(sizes)
    if exponent not in (None, 2) and model != "sp":
        raise InputError(
            f"exponent = {exponent!r} with model = {model!r}: errors were measured of harmonic disks, and droplets "
            "have no exponent; choose disks yourself, model='sp'"
        )
    choice = choose(rho, tolerance, n, model=model)
    law: dict[str, Any] = {} if exponent is None else {"exponent": exponent}
    packing = bring_on(choice.way, find_onset(choice.way, seed, **law), rho, step)
    packing = packing.with_state(provenance={"model_choice": str(choice.way), "model_error": choice.error})
    values = values_at(packing, tuple(QUANTITIES))
    estimate = {name: value + choice.correction[name] for name, value in values.items()}
    return Scene(packing, values, estimate, choice, time.perf_counter() - began)
