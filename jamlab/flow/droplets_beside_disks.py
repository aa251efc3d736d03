"""Steady flow of droplets and of disks at the same true packing fraction, as one table."""

from collections.abc import Iterator, Sequence
from typing import Any

from jamlab.errors import ConvergenceError
from jamlab.flow.shear import shear
from jamlab.packing.packing import Packing
from jamlab.protocols.compression import compress
from jamlab.protocols.onset import jam

ROWS = 50  # per unit of strain
BACKGROUND = 1e-2  # for both, as droplets need it
_STEP = 0.02  # of rho in the compression


def dense_packing(model: str, n: int, seed: int, rho: float) -> Packing:
    """A packing in the units of Boromand et al., compressed from onset to a true packing fraction."""
    *_, packing = compress(jam(model, n, seed), to=rho, step=_STEP)
    return packing


def flow_rows(
    model: str, n: int, seed: int, rho: float, rates: Sequence[float], strain: float = 3.0, discard: float = 1.0
) -> Iterator[dict[str, Any]]:
    """Yield a row for each rate: the steady flow of one packing under balanced contact damping.

    Args:
        model: "sp" or "dp".
        n: number of particles.
        seed: of the packing.
        rho: true packing fraction.
        rates: of shear, 1/tau_1.
        strain: in all.
        discard: strain of start-up that is left out.

    Yields:
        model, n, seed, rho, rate; stress, its elastic part and pressure, each with `..._error`; steady; seconds. A rate
        that is not resolved is left out.
    """
    packing = dense_packing(model, n, seed, rho)
    for rate in rates:
        try:
            run = shear(packing, rate, strain, rows=int(ROWS * strain), background=BACKGROUND)
        except ConvergenceError:
            continue
        row: dict[str, Any] = {"model": model, "n": n, "seed": seed, "rho": rho, "rate": rate}
        for name in ("stress", "elastic_stress", "pressure"):
            mean = run.steady(name, discard=discard)
            row |= {name: mean.value, f"{name}_error": mean.error}
        yield row | {"steady": run.steady(discard=discard).steady, "seconds": run.seconds}
