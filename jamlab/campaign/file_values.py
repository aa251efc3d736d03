"""Values of a campaign file that several of its tables share: numbers in bounds, lists of frequencies, damping laws."""

from typing import Annotated, Any, TypeVar

import numpy as np
from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from jamlab.protocols.onset import LARGEST_TOLERANCE
from jamlab.protocols.relaxation import LEAST_TOLERANCE
from jamlab.rheology.damping import ContactDamping, Damping, StokesDrag

MOST_FREQUENCIES = 10_000  # of a spectrum
LARGEST_NUMBER = 1e100  # frequencies and drag are squared and multiplied: 1e150 would overflow

T = TypeVar("T")


class FileTable(BaseModel):
    """A TOML table without unknown keys and without conversion of text to numbers."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


def as_list(value: Any) -> Any:
    """Take a single value for a list of one."""
    return value if isinstance(value, list) else [value]


def distinct(value: list[T]) -> list[T]:
    """Refuse a list that names something twice, or nothing."""
    if repeated := [entry for k, entry in enumerate(value) if entry in value[:k]]:
        raise ValueError(f"{repeated[0]!r} is listed twice: leave one out")
    if not value:
        raise ValueError("the list is empty: give at least one")
    return value


def _space_evenly_in_log(value: Any) -> Any:
    if isinstance(value, dict):
        grid = LogGrid.model_validate(value)
        omega = np.geomspace(grid.lowest, grid.highest, grid.points)
        return [float(f"{w:.12g}") for w in omega]  # equal on every machine: task names depend on it
    return value


def ascending(values: list[float]) -> list[float]:
    """Sort numbers, so that their order in the file does not enter the names of tasks."""
    return sorted(map(float, values))


Positive = Annotated[float, Field(gt=0, le=LARGEST_NUMBER)]
NotNegative = Annotated[float, Field(ge=0, le=LARGEST_NUMBER)]
_Grid = Annotated[list[T], BeforeValidator(_space_evenly_in_log), Field(min_length=1), AfterValidator(ascending)]
Frequencies = _Grid[Positive]
Rates = _Grid[NotNegative]
OneOrMore = Annotated[list[T], BeforeValidator(as_list), AfterValidator(distinct)]
Prestress = Annotated[OneOrMore[bool], AfterValidator(sorted)]


class LogGrid(FileTable):
    """{ lowest, highest, points }: numbers of equal ratio."""

    lowest: Positive
    highest: Positive
    points: Annotated[int, Field(ge=2, le=MOST_FREQUENCIES)]

    @model_validator(mode="after")
    def _check_order(self) -> "LogGrid":
        if self.lowest >= self.highest:
            raise ValueError(f"lowest = {self.lowest:g} is not below highest = {self.highest:g}: swap them")
        return self


class DampingLaws(FileTable):
    """Damping laws: beta of contact damping and eta_f of Stokes drag, one spectrum for each value."""

    contact: Annotated[list[NotNegative], AfterValidator(ascending)] = []
    stokes: Annotated[list[NotNegative], AfterValidator(ascending)] = []

    @property
    def count(self) -> int:
        """Number of laws."""
        return len(self.contact) + len(self.stokes)

    def with_columns(self, alpha: float = 1.0) -> list[tuple[Damping, dict[str, float]]]:
        """List the laws, contact damping with this power of the velocity, each with its columns in a table."""
        laws: list[tuple[Damping, dict[str, float]]] = []
        for beta in self.contact:
            columns = {"stokes": False, "beta": beta, "eta_f": np.nan, "alpha": alpha}
            laws.append((ContactDamping(beta, alpha=alpha), columns))
        for eta_f in self.stokes:
            laws.append((StokesDrag(eta_f), {"stokes": True, "beta": np.nan, "eta_f": eta_f, "alpha": np.nan}))
        return laws


class Tolerances(FileTable):
    """How well states are minimised, and from which error on results are marked as not converged."""

    max_force: Annotated[float, Field(ge=LEAST_TOLERANCE, le=LARGEST_TOLERANCE)] | None = None  # `tolerance` of `jam`
    step_error: Annotated[float, Field(gt=0, le=1)] | None = None  # `error` of `jamlab.compress`
    spectrum_error: Positive = 1e-3  # estimated relative error of G*
