"""Read the measured controls of estimators: a number whose estimator fails one has no verdict."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path

from studies.tables import DATA, read_table

NAME = "estimator-controls"  # of the table in the folder of data


@dataclass(frozen=True)
class Control:
    """What an estimator gives for a known law."""

    id: str  # of the number
    control: str
    law: str
    stated: float  # what it should give
    plain: float  # what it gives if all packings are drawn once, so that their mean is the law
    recovered: float  # mean over repeats
    error: float  # standard error of that
    scatter: float  # standard deviation of one measurement
    tolerance: float
    passes: bool


@cache
def controls(folder: Path = DATA) -> dict[str, tuple[Control, ...]]:
    """Read the measured controls of each number."""
    table = read_table(folder, NAME)
    rows = [Control(**{str(k): v for k, v in row.items()}) for row in table.to_dict("records")]
    return {name: tuple(row for row in rows if row.id == name) for name in table["id"].unique()}


def control_of(row_id: str) -> tuple[Control, ...]:
    """Give the controls of the estimator of a number; none where it needs none."""
    return controls().get(row_id, ())


def failed(row_id: str) -> str:
    """Say what the estimator of a number gives for a known law, if that is too far off; else nothing."""
    told = [f"{c.recovered:.3g} for {c.stated:.3g} ({c.law})" for c in control_of(row_id) if not c.passes]
    return f"its estimator gives {' and '.join(told)}" if told else ""
