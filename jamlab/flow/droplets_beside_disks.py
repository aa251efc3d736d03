"""Steady flow of droplets and of disks at the same true packing fraction, as one table.

Drag is that of particles against the affine flow: with drag at contacts alone, vertices slide along the edges they
meet, gather at the corners of droplets within a strain of one or two, and steps get ever shorter.
"""

from collections.abc import Iterator, Sequence
from typing import Any

from jamlab.errors import ConvergenceError
from jamlab.flow.shear import shear
from jamlab.packing.packing import Packing
from jamlab.protocols.compression import compress
from jamlab.protocols.onset import jam
from jamlab.rheology.damping import StokesDrag

ROWS = 50  # per unit of strain
_STEP = 0.02  # of rho in the compression


def dense_packing(model: str, n: int, seed: int, rho: float) -> Packing:
    """A packing in the units of Boromand et al., compressed from onset to a true packing fraction."""
    *_, packing = compress(jam(model, n, seed), to=rho, step=_STEP)
    return packing


def flow_rows(
    model: str, n: int, seed: int, rho: float, rates: Sequence[float], strain: float = 3.0, discard: float = 1.0
) -> Iterator[dict[str, Any]]:
    """Yield a row for each rate: the steady flow of one packing under Stokes drag, without the stress of the fluid.

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
            run = shear(packing, rate, strain, StokesDrag(eta_f=0.0), rows=int(ROWS * strain))
        except ConvergenceError:
            continue
        row: dict[str, Any] = {"model": model, "n": n, "seed": seed, "rho": rho, "rate": rate}
        for name in ("stress", "elastic_stress", "pressure"):
            mean = run.steady(name, discard=discard)
            row |= {name: mean.value, f"{name}_error": mean.error}
        yield row | {"steady": run.steady(discard=discard).steady, "seconds": run.seconds}
