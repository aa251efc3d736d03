"""Values of a campaign file: tables without unknown keys, numbers in bounds, lists evenly spaced in a logarithm."""

from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

MOST_FREQUENCIES = 10_000  # of a spectrum
LARGEST_NUMBER = 1e100  # frequencies and drag are squared and multiplied: 1e150 would overflow


class FileTable(BaseModel):
    """A TOML table without unknown keys and without conversion of text to numbers."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


def _space_evenly_in_log(value: Any) -> Any:
    if isinstance(value, dict):
        grid = LogGrid.model_validate(value)
        omega = np.geomspace(grid.lowest, grid.highest, grid.points)
        return [float(f"{w:.12g}") for w in omega]  # equal on every machine: task names depend on it
    return value


Positive = Annotated[float, Field(gt=0, le=LARGEST_NUMBER)]
NotNegative = Annotated[float, Field(ge=0, le=LARGEST_NUMBER)]
Frequencies = Annotated[list[Positive], BeforeValidator(_space_evenly_in_log), Field(min_length=1)]
Rates = Annotated[list[NotNegative], BeforeValidator(_space_evenly_in_log), Field(min_length=1)]


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
