"""Add seeds until the mean over packings is known to a standard error.

For each sweep, model and n, the first eight seeds run. From their values at the last state of each packing follows the
standard error s / sqrt(k) of the mean over k packings, s being their standard deviation, and hence the number of seeds
that the wanted error takes: k (error / wanted)^2, where the column farthest from its aim counts. As s is uncertain for
few packings, the number grows by a quarter at least and doubles at most, until the error is met or no seed is left.

The number depends on the finished tasks alone, not on when and where they ran, so a run that was stopped goes on with
the same seeds. Packings that failed, did not converge or have no value (nan) are left out of the mean.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from jamlab.campaign.folder import CampaignFolder
from jamlab.campaign.task_file import read_last_state
from jamlab.campaign.tasks import Batch
from jamlab.errors import InputError

FIRST_SEEDS = 8  # give the standard deviation to 1 / sqrt(2 (8 - 1)), a quarter
_LEAST_GROWTH, _MOST_GROWTH = 1.25, 2.0


@dataclass(frozen=True)
class Precision:
    """How well the means of one sweep, model and n are known.

    Attributes:
        seeds: number of seeds that are wanted by now.
        errors: column -> standard error of the mean over the packings so far; nan for fewer than two.
        met: whether every error is as small as wanted.
    """

    seeds: int
    errors: dict[str, float] = field(default_factory=dict)
    met: bool = False


def precision(batch: Batch, folder: CampaignFolder, finished: set[str], failed: set[str]) -> Precision:
    """Say how many seeds of a batch are wanted, and how well its means are known.

    Args:
        batch: with `until`.
        folder: of the campaign.
        finished: names of finished tasks.
        failed: names of failed tasks.

    Raises:
        InputError: a column of `until` does not exist.
        StorageError: a file is damaged.
    """
    if not batch.until:
        return Precision(len(batch.seeds))
    values: dict[str, list[float]] = {column: [] for column in batch.until}
    names = batch.names()
    wanted, done = min(FIRST_SEEDS, len(batch.seeds)), 0
    while True:
        for name in (next(names) for _ in range(wanted - done)):
            if name in finished:
                _take(values, batch, folder, name)
            elif name not in failed:
                return Precision(wanted, _standard_errors(values))
        done, errors = wanted, _standard_errors(values)
        met = all(errors[column] <= aim for column, aim in batch.until.items())
        if met or done == len(batch.seeds):
            return Precision(done, errors, met)
        wanted = min(_next_count(done, errors, batch.until), len(batch.seeds))


def wanted_batches(batches: Sequence[Batch], folder: CampaignFolder) -> list[Batch]:
    """Cut batches to the seeds that are wanted by now. Errors as in `precision`."""
    finished, failed = folder.finished(), folder.failed()
    return [batch.first(precision(batch, folder, finished, failed).seeds) for batch in batches]


def _take(values: dict[str, list[float]], batch: Batch, folder: CampaignFolder, name: str) -> None:
    state = read_last_state(folder.task_file(name))
    for column, found in values.items():
        if column not in state:
            raise InputError(
                f"until.{column} of sweep {batch.sweep}: table states has no such column: use one of {', '.join(state)}"
            )
        if state["converged"] and math.isfinite(state[column]):
            found.append(state[column])


def _standard_errors(values: dict[str, list[float]]) -> dict[str, float]:
    return {column: standard_error(found) for column, found in values.items()}


def standard_error(values: Sequence[float]) -> float:
    """Standard error of the mean of independent values; nan for fewer than two."""
    return float(np.std(values, ddof=1) / np.sqrt(len(values))) if len(values) > 1 else math.nan


def _next_count(count: int, errors: dict[str, float], until: dict[str, float]) -> int:
    """Number of seeds to go to from `count`."""
    ratio = max((errors[column] / aim) ** 2 if errors[column] >= 0 else _MOST_GROWTH for column, aim in until.items())
    return math.ceil(count * min(max(ratio, _LEAST_GROWTH), _MOST_GROWTH))
