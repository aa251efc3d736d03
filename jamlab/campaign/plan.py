"""Estimate what a campaign will take before it runs: seconds on one core and bytes on disk.

Finished tasks of the same sweep, model and n are the best guide. Where there are none, the time is interpolated between
the measured points below, linearly in log n and log t; it is good to a factor of two.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from jamlab.campaign.folder import CampaignFolder
from jamlab.campaign.measurements import SCHEMA
from jamlab.campaign.task_file import read_seconds
from jamlab.campaign.tasks import Batch
from jamlab.errors import StorageError
from jamlab.protocols.compression import grid

_SAMPLES = 8  # finished tasks to average over; reading more would slow down `plan`

# (n, seconds), medians over seeds on one core of 2026 with the default force laws
_ONSET_TIME = {
    "sp": ((32, 0.3), (64, 0.5), (128, 1.3), (256, 5.0), (1024, 60.0)),
    "dp": ((16, 2.0), (32, 5.0), (64, 20.0)),
}
_STATE_TIME = {  # of a compression, measured and stored
    "sp": ((32, 0.02), (64, 0.03), (128, 0.05), (256, 0.1), (1024, 0.6)),
    "dp": ((16, 0.2), (32, 0.3), (64, 0.7)),
}
_PACK_TIME = ((32, 0.05), (128, 0.1), (512, 0.7), (2048, 1.8), (32768, 120.0))  # at pressure 1e-2
_PACK_EXPONENT = -0.2  # of the pressure: softer packings converge more slowly
_STABILIZED_FACTOR = 2.5  # in time, where the box is sheared too
_SPECTRUM_TIME = {  # at 41 frequencies
    "sp": ((32, 0.03), (128, 0.04), (512, 0.1), (2048, 0.4), (32768, 25.0)),
    "dp": ((16, 0.08), (64, 0.2)),
}
_CORRELATION_FACTOR = 0.2  # time at one frequency over that of a spectrum

_ONSET_PHI = 0.84  # typical of bidisperse disks; sets the number of states of a sweep
_VERTICES = 14.5  # per droplet: the mean of small and large ones
_FILE_BYTES = 60_000  # names and headers of HDF5
_STATE_BYTES = 700  # observables, box and provenance of a frame
_POSITION_BYTES = 24  # of a disk or vertex: x, y and z = 0 in float64


@dataclass(frozen=True)
class Estimate:
    """Estimated cost of one sweep, model and n.

    Attributes:
        sweep: its name.
        model: "sp" or "dp".
        n: number of particles.
        tasks: number of tasks.
        left: number of tasks neither finished nor failed.
        states: number of packings in each task.
        seconds: on one core, for the tasks left.
        bytes: on disk, for the tasks left.
        measured: whether the time is that of finished tasks of the same kind.
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
    """Estimate the cost of each sweep, model and n."""
    finished, failed = folder.finished(), folder.failed()
    lines = []
    for batch in batches:
        names = list(batch.names())
        left = sum(name not in finished and name not in failed for name in names)
        states = state_count(batch.parameters)
        seconds = _mean_seconds(folder, [name for name in names if name in finished][:_SAMPLES])
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
    """Order batches by the time of their tasks, so that no worker is left alone with a long one at the end."""
    return sorted(batches, key=lambda batch: -task_seconds(batch.parameters))


def state_count(parameters: dict[str, Any]) -> int:
    """Count the frames of a task; those of a compression as from the typical onset."""
    if "pressures" in parameters:
        return len(parameters["pressures"])
    if "compress" not in parameters:
        return 1
    how = parameters["compress"]
    start = min(_ONSET_PHI, 0.99 * how["to"])
    return 1 + len(grid(start, how["to"], how["step"], how["nearest"], how["per_decade"]))


def task_seconds(parameters: dict[str, Any]) -> float:
    """Estimate the time of one task on one core, s."""
    model, n, states = parameters["model"], parameters["n"], state_count(parameters)
    if "pressures" in parameters:
        scale = sum((p / 1e-2) ** _PACK_EXPONENT for p in parameters["pressures"])
        total = _interpolate(_PACK_TIME, n) * scale
    else:
        total = _interpolate(_ONSET_TIME[model], n) + (states - 1) * _interpolate(_STATE_TIME[model], n)
    if parameters["ensemble"] == "shear-stabilized":
        total *= _STABILIZED_FACTOR
    return float(total + _interpolate(_SPECTRUM_TIME[model], n) * states * _count_spectra(parameters))


def task_bytes(parameters: dict[str, Any]) -> int:
    """Estimate the size of the file of one task."""
    n, states = parameters["n"], state_count(parameters)
    positions = n if parameters["model"] == "sp" else _VERTICES * n
    laws = _count_laws(parameters)
    rows = _row_bytes("spectra") * laws * len(parameters.get("omega", ()))
    rows += _row_bytes("correlation") * laws * len(parameters.get("correlation_omega", ())) * np.sqrt(n)
    rows += _row_bytes("voids") * n * ("voids" in parameters["observables"])
    return int(_FILE_BYTES + states * (_POSITION_BYTES * positions + _STATE_BYTES + rows))


def _row_bytes(table: str) -> int:
    return sum(kind.itemsize for kind in SCHEMA[table].values())


def _count_laws(parameters: dict[str, Any]) -> int:
    damping = parameters.get("damping", {})
    return sum(map(len, damping.values())) * len(parameters.get("prestress", ()))


def _count_spectra(parameters: dict[str, Any]) -> float:
    """Count the spectra of each state, with correlations as the fraction of a spectrum that they cost."""
    spectra = _count_laws(parameters) * ("omega" in parameters)
    return float(spectra) + _CORRELATION_FACTOR * _count_laws(parameters) * len(parameters.get("correlation_omega", ()))


def _interpolate(points: tuple[tuple[int, float], ...], n: int) -> float:
    """Interpolate linearly in log n and log t; beyond the last point, extrapolate."""
    x, y = np.log(np.array(points)).T
    slope = (y[-1] - y[-2]) / (x[-1] - x[-2])
    beyond = max(0.0, np.log(n) - x[-1]) * slope
    return float(np.exp(np.interp(np.log(n), x, y) + beyond))


def _mean_seconds(folder: CampaignFolder, names: list[str]) -> float | None:
    seconds = []
    for name in names:
        try:
            seconds.append(read_seconds(folder.task_file(name)))
        except StorageError:  # damaged: `run` will find it and run it again
            continue
    return float(np.mean(seconds)) if seconds else None
