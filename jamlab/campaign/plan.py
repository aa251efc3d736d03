"""What a campaign will take, before it runs: seconds of one core and bytes on disk.

Finished tasks of the same sweep, model and n tell best. Where there are none, the estimate interpolates what tasks took
on one core of 2026, seconds against n on logarithmic axes; it is good to a factor of two.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from jamlab.campaign.folder import CampaignFolder
from jamlab.campaign.task_file import read_seconds
from jamlab.campaign.tasks import Batch
from jamlab.errors import StorageError
from jamlab.protocols.compression import grid

_SAMPLES = 8  # finished tasks that speak for their batch
_ONSET = {"sp": ((32, 0.3), (64, 0.5), (128, 1.3), (256, 5.0), (1024, 60.0)), "dp": ((16, 6.0), (32, 20.0), (64, 30.0))}
_STATE = {"sp": ((32, 0.02), (64, 0.03), (128, 0.05), (256, 0.1), (1024, 0.6)), "dp": ((16, 0.5), (32, 1.2), (64, 2.0))}
_PACK = ((32, 0.05), (128, 0.1), (512, 0.7), (2048, 3.0), (32768, 120.0))  # at pressure 1e-2
_PACK_EXPONENT = -0.2  # of the pressure
_STABILIZED = 2.5  # packings whose box is sheared too
_SPECTRUM = {
    "sp": ((32, 0.03), (128, 0.1), (512, 0.3), (2048, 0.8), (32768, 25.0)),
    "dp": ((16, 0.5), (64, 2.0)),
}
_ONSET_PHI = 0.84
_VERTICES = 14.5  # of a droplet, mean
_FILE_BYTES = 60_000  # names and headers of HDF5
_STATE_BYTES = 700  # observables of a frame
_SPECTRUM_ROW, _VOID_ROW, _CORRELATION_ROW = 98, 48, 90


@dataclass(frozen=True)
class Estimate:
    """One line of a plan.

    Attributes:
        sweep: its name.
        model: "sp" or "dp".
        n: particles.
        tasks: all.
        left: not finished and not failed.
        states: packings in each task.
        seconds: of one core, for the tasks that are left.
        bytes: of the tasks that are left.
        measured: whether finished tasks of the same kind tell the seconds.
    """

    sweep: str
    model: str
    n: int
    tasks: int
    left: int
    states: int
    seconds: float
    bytes: int
    measured: bool


def plan(batches: list[Batch], folder: CampaignFolder) -> list[Estimate]:
    """Estimate for each sweep, model and n."""
    finished, failed = folder.finished(), folder.failed()
    lines = []
    for batch in batches:
        names = list(batch.names())
        left = sum(name not in finished and name not in failed for name in names)
        states = state_count(batch.parameters)
        seconds = _measured(folder, [name for name in names if name in finished][:_SAMPLES])
        lines.append(
            Estimate(
                batch.sweep,
                batch.parameters["model"],
                batch.parameters["n"],
                len(names),
                left,
                states,
                left * (task_seconds(batch.parameters) if seconds is None else seconds),
                left * task_bytes(batch.parameters),
                seconds is not None,
            )
        )
    return lines


def longest_first(batches: list[Batch]) -> list[Batch]:
    """Batches in the order to run them: at the end no worker is left alone with a long task."""
    return sorted(batches, key=lambda batch: -task_seconds(batch.parameters))


def state_count(parameters: dict[str, Any]) -> int:
    """Frames of a task; for a compression as from the typical onset."""
    if "pressures" in parameters:
        return len(parameters["pressures"])
    if "compress" not in parameters:
        return 1
    how = parameters["compress"]
    start = min(_ONSET_PHI, 0.99 * how["to"])
    return 1 + len(grid(start, how["to"], how["step"], how["nearest"], how["per_decade"]))


def task_seconds(parameters: dict[str, Any]) -> float:
    """Seconds of one core for one task."""
    model, n, states = parameters["model"], parameters["n"], state_count(parameters)
    if "pressures" in parameters:
        scale = sum((p / 1e-2) ** _PACK_EXPONENT for p in parameters["pressures"])
        total = _at(_PACK, n) * scale
    else:
        total = _at(_ONSET[model], n) + (states - 1) * _at(_STATE[model], n)
    if parameters["ensemble"] == "shear-stabilized":
        total *= _STABILIZED
    return float(total + _at(_SPECTRUM[model], n) * states * _solutions(parameters))


def task_bytes(parameters: dict[str, Any]) -> int:
    """Bytes of one file."""
    n, states = parameters["n"], state_count(parameters)
    positions = n if parameters["model"] == "sp" else _VERTICES * n
    laws = _laws(parameters)
    rows = _SPECTRUM_ROW * laws * len(parameters.get("omega", ()))
    rows += _CORRELATION_ROW * laws * len(parameters.get("correlation_omega", ())) * np.sqrt(n)
    rows += _VOID_ROW * n * ("voids" in parameters["observables"])
    return int(_FILE_BYTES + states * (24 * positions + _STATE_BYTES + rows))


def _laws(parameters: dict[str, Any]) -> int:
    damping = parameters.get("damping", {})
    return sum(map(len, damping.values())) * len(parameters.get("prestress", ()))


def _solutions(parameters: dict[str, Any]) -> float:
    """Spectra per state, or what costs as much."""
    spectra = _laws(parameters) * ("omega" in parameters)
    return float(spectra) + 0.2 * _laws(parameters) * len(parameters.get("correlation_omega", ()))


def _at(points: tuple[tuple[int, float], ...], n: int) -> float:
    """Straight lines between points on logarithmic axes, the last of them prolonged."""
    x, y = np.log(np.array(points)).T
    slope = (y[-1] - y[-2]) / (x[-1] - x[-2])
    beyond = max(0.0, np.log(n) - x[-1]) * slope
    return float(np.exp(np.interp(np.log(n), x, y) + beyond))


def _measured(folder: CampaignFolder, names: list[str]) -> float | None:
    seconds = []
    for name in names:
        try:
            seconds.append(read_seconds(folder.task_file(name)))
        except StorageError:  # damaged: `run` will find it and do it again
            continue
    return float(np.mean(seconds)) if seconds else None
