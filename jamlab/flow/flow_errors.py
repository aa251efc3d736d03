"""How far simpler models of flow are off, measured: runs beside them, and the error that they promise elsewhere.

`flow_errors.csv` in this package, made by `jamlab chart flow-table`, holds runs of disks at many conditions, each with
the error of the simpler model. Two numbers carry them over to other packings: amplitude over overlap, which says
whether contacts change, and drag over elasticity of a contact that moves with the affine flow.
"""

from __future__ import annotations

from functools import cache
from importlib import resources
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from jamlab.errors import StorageError
from jamlab.mechanics.stiffness import stress
from jamlab.packing.packing import Packing
from jamlab.rheology.damping import ContactDamping, Damping, StokesDrag, drag_stiffness

Array = NDArray[np.float64]

STOKES = 0.0  # in the place of alpha
CONFIDENCE = 0.95  # share of new packings whose error is to stay below the one promised
LEAST_ERROR = 0.01  # that a promise can be: runs of the table are as good as that
COLUMNS = ("kind", "part", "seed", "n", "pressure", "alpha", "drag", "amplitude", "error", "scatter", "seconds")


def relative_amplitude(packing: Packing, amplitude: float) -> float:
    """Strain over the mean overlap of contacts, pressure over stiffness: at 1 a good part of the contacts changes."""
    pressure = 0.5 * float(np.trace(stress(packing)))
    return amplitude * drag_stiffness(packing) / pressure


def relative_drag(damping: Damping, omega: float, amplitude: float) -> float:
    """Drag over elastic force of a contact that moves with the affine flow: (tau_1 omega)^alpha amplitude^(alpha - 1).

    While contacts stay, G* depends on frequency and amplitude by it alone.
    """
    alpha = damping.alpha if isinstance(damping, ContactDamping) else 1.0
    return float((damping.tau * omega) ** alpha * amplitude ** (alpha - 1.0))


def law_number(damping: Damping) -> float:
    """Exponent alpha of contact drag, or `STOKES`."""
    return STOKES if isinstance(damping, StokesDrag) else damping.alpha


@cache
def read_errors(path: Path | None = None) -> pd.DataFrame:
    """The shipped runs, or those written by `jamlab chart flow-table`.

    Raises:
        StorageError: it cannot be read, or is no such table.
    """
    source = path or resources.files("jamlab.flow").joinpath("flow_errors.csv")
    try:
        with source.open("rb") as file:
            table = pd.read_csv(file, comment="#")
    except (OSError, ValueError) as error:
        raise StorageError(f"cannot read {source}: {error}; make it with `jamlab chart flow-table`") from error
    if tuple(table.columns) != COLUMNS:
        raise StorageError(f"{source} is no table of errors of flow: make one with `jamlab chart flow-table`")
    return table
