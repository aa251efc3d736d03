"""Start-up and steady flow of many packings at several packing fractions and rates, as one table."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError
from jamlab.flow.shear import shear
from jamlab.packing.deformation import at_phi
from jamlab.packing.packing import Packing
from jamlab.protocols.relaxation import relax
from jamlab.protocols.target_pressure import pack
from jamlab.rheology.damping import ContactDamping

if TYPE_CHECKING:
    import pandas as pd

PRESSURE = 1e-2  # of the packings that are brought to each packing fraction
FORCE = 1e-6  # left at the start: below the forces of the slowest flow
ROWS = 50  # per unit of strain


def quenched(n: int, seed: int, phi: float) -> Packing:
    """Disks of a packing well above onset, brought to a packing fraction and relaxed there; loose below onset."""
    start = at_phi(pack(n, PRESSURE, seed), phi)
    with Session(start) as session:
        relax(session, FORCE)
        return session.packing()


def flow_rows(
    n: int,
    seed: int,
    phi: float,
    rates: Sequence[float],
    *,
    alpha: float = 1.0,
    strain: float = 3.0,
    discard: float = 1.0,
    background: float = 1e-2,
) -> Iterator[dict[str, Any]]:
    """Yield a row for each rate: the overshoot and the steady state of one packing.

    Args:
        n: number of disks.
        seed: of the packing.
        phi: nominal packing fraction.
        rates: of shear, 1/tau_1.
        alpha: power of the velocity in the drag.
        strain, discard: of the average, and before it.
        background: see `shear`.

    Yields:
        n, seed, phi, alpha, rate; stress, pressure, normal_stress_difference of steady flow, each with `..._error`;
        peak_stress and peak_strain, nan without overshoot; steady; seconds. A rate that is not resolved is left out.
    """
    packing = quenched(n, seed, phi)
    rows = int(ROWS * (strain + discard))
    for rate in rates:
        try:
            run = shear(
                *(packing, rate, strain + discard, ContactDamping(alpha=alpha)), rows=rows, background=background
            )
        except ConvergenceError:
            continue
        row: dict[str, Any] = {"n": n, "seed": seed, "phi": phi, "alpha": alpha, "rate": rate}
        for name in ("stress", "pressure", "normal_stress_difference"):
            mean = run.steady(name, discard=discard)
            row |= {name: mean.value, f"{name}_error": mean.error}
        peak = run.peak
        row |= {"peak_stress": peak.stress if peak else None, "peak_strain": peak.strain if peak else None}
        yield row | {"steady": run.steady(discard=discard).steady, "seconds": run.seconds}


def flow_table(
    n: int, seeds: Sequence[int], fractions: Sequence[float], rates: Sequence[float], **how: float
) -> pd.DataFrame:
    """Collect the rows of all packings; see `flow_rows`."""
    import pandas as pd

    return pd.DataFrame([row for seed in seeds for phi in fractions for row in flow_rows(n, seed, phi, rates, **how)])
