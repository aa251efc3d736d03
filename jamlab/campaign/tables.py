"""Collect task files into tidy tables."""

from collections.abc import Callable, Iterable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from jamlab.campaign.flow_file import FLOWS
from jamlab.campaign.folder import CampaignFolder
from jamlab.campaign.measurements import SCHEMA
from jamlab.campaign.task_file import TaskFile, read_task_file, read_task_table
from jamlab.checks import check_choice
from jamlab.errors import InputError
from jamlab.measure import COLUMNS

if TYPE_CHECKING:
    import pandas as pd

TABLES = ("states", "onset", "spectra", "quasistatic", "correlation", "modes", "voids", *FLOWS)

DISTANCES = ("d_rho", "d_phi")  # from onset; columns that `Campaign.aggregate` adds to "states"

_WHO = ("task", "model", "n", "seed", "ensemble")
_FLOW_STATE = ("phi", "rho", "background", "tolerance")  # of a flow: where it starts, and how it was run
TABLE_COLUMNS: dict[str, tuple[str, ...]] = {
    "states": (
        *_WHO,
        *("units", "state", "onset", "onset_phi", "target_pressure", "converged", *COLUMNS),
        *("gamma", "ka", "delta", "eps", "nv_small", "contact", "wall_time"),
    ),
    "onset": (*_WHO, *SCHEMA["onset"], "seconds"),
    "voids": (*_WHO, "state", "rho", "onset", "sides", "area", "perimeter", "shape", "particle_area"),
    **{
        name: (*_WHO, *(column if column != "stokes" else "law" for column in SCHEMA[name]))
        for name in ("spectra", "quasistatic", "correlation", "modes")
    },
    **{
        name: (*_WHO, *_FLOW_STATE, *(column if column != "stokes" else "law" for column in SCHEMA[name]))
        for name in FLOWS
    },
}
STATE_COLUMNS = (*TABLE_COLUMNS["states"], *DISTANCES)  # names that no observable of the user's own may have


def table(folder: CampaignFolder, names: Iterable[str], name: str) -> "pd.DataFrame":
    """Collect one table from many tasks.

    Args:
        folder: of the campaign.
        names: of the finished tasks.
        name: one of `TABLES`.

    Returns:
        Columns `TABLE_COLUMNS[name]`; "states" also has those of the user's own observables, nan where a task lacks
        them. Rows are sorted by model, n and seed, and within a task as in its file.

    Raises:
        InputError: there is no such table, or two of the user's own observables have a column of the same name.
        StorageError: a file is damaged.
    """
    import pandas as pd

    check_choice("table", name, TABLES)
    parts: list[dict[str, Any]] = []
    own: dict[str, str] = {}
    for task in names:
        path = folder.task_file(task)
        if name in _OF_FILES:
            file = read_task_file(path)
            columns = _OF_FILES[name](file)
            parameters = file.parameters
            if name == "states":
                columns |= _own(file, own)
        else:
            parameters, found = read_task_table(path, name)
            columns = _name_laws(found)
        if columns:
            who = {"task": task, **{key: parameters[key] for key in _WHO[1:]}}
            parts.append({**who, **columns})
    parts.sort(key=lambda part: tuple(part[key] for key in ("model", "n", "seed", "task")))
    frames = {}
    for column in (*TABLE_COLUMNS[name], *sorted(own)):
        values = [
            np.broadcast_to(np.asarray(part.get(column, np.nan) if column in own else part[column]), _row_count(part))
            for part in parts
        ]
        frames[column] = np.concatenate(values) if values else np.empty(0)
    return pd.DataFrame(frames)


def _row_count(part: dict[str, Any]) -> int:
    return next(len(values) for values in part.values() if isinstance(values, np.ndarray))


def _states(file: TaskFile) -> dict[str, Any]:
    law = file.parameters["force_law"] if file.parameters["model"] == "dp" else {}
    rho_j, phi_j = _at_onset(file)
    return {
        "units": file.units,
        "state": np.arange(len(file.converged)),
        "onset": rho_j,
        "onset_phi": phi_j,
        "target_pressure": file.target_pressure,
        "converged": file.converged,
        **{name: file.observables[name] for name in COLUMNS},
        **{name: law.get(name, np.nan) for name in ("gamma", "ka", "delta", "eps", "nv_small")},
        "contact": str(law.get("contact", "")),
        "wall_time": file.wall_time,
    }


def _own(file: TaskFile, known: dict[str, str]) -> dict[str, Any]:
    """Return the columns of the user's own observables, and note in `known` which observable each belongs to."""
    found: dict[str, Any] = {}
    for observable, columns in file.tables.items():
        if ":" in observable:
            for column in columns:
                if known.setdefault(column, observable) != observable:
                    raise InputError(
                        f"{observable} and {known[column]} both have a column {column!r}: take one sweep at a time"
                    )
            found |= columns
    return found


def _onset(file: TaskFile) -> dict[str, Any]:
    return {**file.tables["onset"], "seconds": file.seconds} if "onset" in file.tables else {}


def _voids(file: TaskFile) -> dict[str, Any]:
    if "voids" not in file.tables:
        return {}
    columns = file.tables["voids"]
    return {**columns, "rho": file.observables["rho"][columns["state"]], "onset": _at_onset(file)[0]}


def _flow(name: str, file: TaskFile) -> dict[str, Any]:
    if name not in file.tables:
        return {}
    columns, how = _name_laws(file.tables[name]), file.parameters[name]
    given = {key: np.nan if how[key] is None else how[key] for key in ("background", "tolerance")}
    return {**columns, **given, **{key: file.observables[key][columns["state"]] for key in ("phi", "rho")}}


def _at_onset(file: TaskFile) -> tuple[float, float]:
    """Return rho_J and phi_J; nan for packings at a pressure."""
    if "onset" not in file.tables:
        return np.nan, np.nan
    return float(file.tables["onset"]["rho_J"][0]), float(file.tables["onset"]["phi_J"][0])


def _name_laws(columns: dict[str, Any]) -> dict[str, Any]:
    if "stokes" not in columns:
        return columns
    return {**columns, "law": np.where(columns["stokes"], "stokes", "contact")}


_OF_FILES: dict[str, Callable[[TaskFile], dict[str, Any]]] = {  # tables that take more than one table of a file
    **{"states": _states, "onset": _onset, "voids": _voids},
    **{name: partial(_flow, name) for name in FLOWS},
}
