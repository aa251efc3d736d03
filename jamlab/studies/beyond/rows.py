"""Choose rows of the tables of droplets of several force laws, and write means with their intervals."""

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from jamlab.errors import InputError
from jamlab.statistics.bootstrap import Interval
from jamlab.studies.droplet_tables import LAW, PACKING
from jamlab.studies.ensembles import FEWEST

LAW_WORDS = {"contact": "contact drag", "stokes": "Stokes drag"}
DROPLETS = {"sp": "disks", "dp": "droplets"}


def usual_law(table: pd.DataFrame) -> dict[str, float]:
    """The force law that most packings of droplets have.

    Raises:
        InputError: there are no droplets.
    """
    droplets = table[table["model"] == "dp"].drop_duplicates(PACKING)
    if droplets.empty:
        raise InputError("the table has no droplets: run the campaign beyond_the_papers")
    return dict(zip(LAW, droplets[LAW].value_counts().index[0], strict=True))


def droplets_with(table: pd.DataFrame, **changes: float) -> pd.DataFrame:
    """Rows of droplets of the usual force law, but for some of its parameters."""
    rows = table[table["model"] == "dp"]
    for name, value in (usual_law(table) | changes).items():
        rows = rows[np.isclose(rows[name], value)]
    return rows


def values_of(table: pd.DataFrame, parameter: str) -> list[float]:
    """Values of one parameter of the force law that `FEWEST` packings have, the others being usual; ascending."""
    rows = table[table["model"] == "dp"]
    for name, value in usual_law(table).items():
        if name != parameter:
            rows = rows[np.isclose(rows[name], value)]
    packings = rows.drop_duplicates(PACKING)[parameter].value_counts()
    return sorted(packings.index[packings >= FEWEST].to_numpy(dtype=np.float64).tolist())


def say(found: Interval | None, digits: int = 2) -> str:
    """A number with its 95 % interval, such as "0.21 [0.19, 0.23]"."""
    if found is None:
        return "not measured"
    if found.value.ndim:
        found = Interval(*(part.ravel()[0] for part in (found.value, found.low, found.high)))
    return f"{_show(found.value, digits)} [{_show(found.low, digits)}, {_show(found.high, digits)}]"


def _show(value: ArrayLike, digits: int) -> str:
    number = float(np.asarray(value))
    return f"{number:.{digits}f}" if abs(number) >= 10.0**-digits or number == 0 else f"{number:.2g}"
