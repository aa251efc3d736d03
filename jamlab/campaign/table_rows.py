"""What all tables of a task share: a row, the columns of its state, and those of its damping law."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jamlab.campaign.states import TaskStates
from jamlab.rheology.damping import ContactDamping, Damping, StokesDrag

Row = dict[str, ArrayLike]  # column -> a number, or an array: as many rows as it is long


def state_columns(states: TaskStates, pressure: NDArray[np.float64], k: int) -> Row:
    """The state that a row belongs to, and its pressure at rest."""
    return {"state": k, "pressure": pressure[k], "target_pressure": states.target_pressures[k]}


def damping_laws(parameters: dict[str, Any]) -> list[Damping]:
    """List every damping law that the task asks for."""
    laws: list[Damping] = [ContactDamping(beta=beta) for beta in parameters["damping"]["contact"]]
    return laws + [StokesDrag(eta_f=eta_f) for eta_f in parameters["damping"]["stokes"]]


def law_columns(law: Damping) -> Row:
    """Columns of a damping law."""
    if isinstance(law, StokesDrag):
        return {"stokes": True, "beta": np.nan, "eta_f": law.eta_f}
    return {"stokes": False, "beta": law.beta, "eta_f": np.nan}
