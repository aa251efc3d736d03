"""Cost of a task: CPU seconds on one core and bytes on disk, from its parameters alone.

Times are interpolated linearly in log n and log t between means over seeds that were measured part by part on one core
of 2026, with the default force laws. `machine_speed` says how much longer the machine at hand takes.
"""

import time
from collections.abc import Collection
from functools import cache
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from jamlab.campaign.measurements import SCHEMA
from jamlab.measure import measure
from jamlab.packing.packing import Packing
from jamlab.protocols.compression import grid

Points = tuple[tuple[int, float], ...]  # (n, seconds)

_ONSET_TIME: dict[str, Points] = {
    "sp": ((32, 0.24), (64, 0.4), (128, 0.85), (256, 3.1), (1024, 60.0)),
    "dp": ((8, 1.4), (16, 2.3), (32, 3.8), (64, 14.0), (128, 33.0), (256, 200.0)),
}
_STABILIZED_ONSET_TIME: Points = ((32, 0.65), (64, 1.0), (128, 1.4))  # where the box is sheared too
_STATE_TIME: dict[str, Points] = {  # of a compression
    "sp": ((32, 0.003), (64, 0.009), (128, 0.03), (256, 0.08), (1024, 0.6)),
    "dp": ((8, 0.043), (16, 0.075), (32, 0.12), (64, 0.24), (128, 0.9), (256, 3.4)),
}
_PACK_PRESSURES = (1e-2, 1e-5)  # between which log t is linear in log p: softer packings converge more slowly
_PACK_TIME: dict[str, tuple[Points, Points]] = {  # at these pressures
    "fixed-box": (
        ((32, 0.042), (128, 0.057), (512, 0.11), (2048, 0.5), (32768, 120.0)),
        ((32, 0.07), (128, 0.16), (512, 0.6), (2048, 13.0), (32768, 480.0)),
    ),
    "shear-stabilized": (
        ((32, 0.042), (128, 0.067), (512, 0.12), (2048, 1.5)),
        ((32, 0.07), (128, 0.14), (512, 1.1), (2048, 13.0)),
    ),
}
_RANKED_SHARE = 0.95  # of the time to make a large packing, which first-order minimisation by ranks takes
_RANKED_SECONDS = 4.0  # wall time to start ranks for the minimisations of one packing, half a second each
_MEASURE_TIME: dict[str, Points] = {  # of table "states"
    "sp": ((32, 0.0045), (128, 0.008), (512, 0.02), (2048, 0.065)),
    "dp": ((16, 0.017), (32, 0.029), (64, 0.055)),
}
_VOIDS_TIME: dict[str, Points] = {
    "sp": ((32, 0.002), (128, 0.004), (256, 0.0055)),
    "dp": ((16, 0.0055), (32, 0.008)),
}
_SPECTRUM_TIME: dict[str, Points] = {  # at 41 frequencies
    "sp": ((32, 0.0075), (128, 0.02), (512, 0.06), (2048, 0.2), (32768, 25.0)),
    "dp": ((16, 0.07), (32, 0.08), (64, 0.2)),
}
_MODES_TIME: Points = ((16, 0.07), (32, 0.5), (64, 3.5))
_FLOW_TIME = (0.7, 1.1e-3)  # of 256 disks, s per unit of strain: at high rates, and over the rate at low ones
_MINIMUM_TIME = 0.12  # of 256 disks, s: after a step of quasi-static shear
_CYCLE_TIME = (0.3, 1.5e-3)  # of 256 disks, s: at high frequencies, and over the frequency at low ones
_CREEP_TIME = 4e-4  # of 256 disks, s per unit of time
_FLOW_GROWTH = 1.2  # exponent of n
_ONE_FREQUENCY = 0.2  # time at one frequency over that of a spectrum

DRIVING = 1.2  # CPU of a campaign over that of its parts: Dask and files; 1.6, 1.6 and 1.2 on a machine at full load
WORKER_SECONDS = 3.5  # CPU to start one worker and the driver, which load Dask, LAMMPS and the solvers

_CRYSTAL = 12  # disks along each side of the packing on which the machine is timed
_MEASUREMENTS = 30
_CRYSTAL_TIME = 0.27  # s that these took where the times above were measured

_ONSET_PHI = 0.84  # typical of bidisperse disks; sets the number of states of a sweep
_VERTICES = 14.5  # per droplet: the mean of small and large ones
_FILE_BYTES = 60_000  # names and headers of HDF5
_STATE_BYTES = 700  # observables, box and provenance of a frame
_POSITION_BYTES = 24  # of a disk or vertex: x, y and z = 0 in float64


def state_count(parameters: dict[str, Any]) -> int:
    """Count the frames of a task; those of a compression as from the typical onset."""
    for key in ("pressures", "phi"):
        if key in parameters:
            return len(parameters[key])
    if "compress" not in parameters:
        return 1
    how = parameters["compress"]
    start = min(_ONSET_PHI, 0.99 * how["to"])
    halvings = 0
    if how.get("confluence") is not None:
        halvings = max(0, int(np.ceil(np.log2(how["step"] / how["confluence"]))))
    return 1 + len(grid(start, how["to"], how["step"], how["nearest"], how["per_decade"])) + halvings


def task_seconds(parameters: dict[str, Any], ranks: int = 1) -> float:
    """Estimate the wall time of one task whose packings are minimised by some MPI ranks, s."""
    making = _making_seconds(parameters)
    if ranks > 1:
        making = making * (1 - _RANKED_SHARE + _RANKED_SHARE / ranks) + _RANKED_SECONDS * state_count(parameters)
    return making + measuring_seconds(parameters)


def _making_seconds(parameters: dict[str, Any]) -> float:
    model, n, states = parameters["model"], parameters["n"], state_count(parameters)
    sheared = parameters["ensemble"] == "shear-stabilized"
    if "pressures" in parameters:
        dense, soft = (_interpolate(points, n) for points in _PACK_TIME[parameters["ensemble"]])
        high, low = _PACK_PRESSURES
        share = np.log(np.array(parameters["pressures"]) / high) / np.log(low / high)
        return float(np.sum(dense * (soft / dense) ** share))
    if "phi" in parameters:  # a quench each, which takes the longest near onset
        return states * _interpolate(_PACK_TIME["fixed-box"][0], n)
    onset = _STABILIZED_ONSET_TIME if sheared and model == "sp" else _ONSET_TIME[model]
    return _interpolate(onset, n) + (states - 1) * _interpolate(_STATE_TIME[model], n)


def measuring_seconds(parameters: dict[str, Any], known: Collection[str] = ()) -> float:
    """Estimate the time to measure the states of one task, s.

    Args:
        parameters: of the task.
        known: observables that are measured already.
    """
    model, n = parameters["model"], parameters["n"]
    wanted = set(parameters["observables"]) - set(known)
    laws, prestress = _count_laws(parameters), len(parameters.get("prestress", ()))
    frequencies = len(parameters.get("correlation_omega", ()))
    solutions = laws * frequencies * ("correlation" in wanted) + prestress * ("quasistatic" in wanted)
    spectra = laws * ("spectra" in wanted) + _ONE_FREQUENCY * solutions
    each = spectra * _interpolate(_SPECTRUM_TIME[model], n)
    if "modes" in wanted:
        each += sum(map(len, parameters["damping"].values())) * _interpolate(_MODES_TIME, n)
    for name, points in (("states", _MEASURE_TIME), ("voids", _VOIDS_TIME)):
        each += _interpolate(points[model], n) * (name in wanted)
    return each * state_count(parameters) + _flow_seconds(parameters, wanted)


def _flow_seconds(parameters: dict[str, Any], wanted: set[str]) -> float:
    """Time of all flows: by every damping law, from every state unless the last alone is asked for."""
    fast, slow = _FLOW_TIME
    seconds, states = 0.0, state_count(parameters)
    if "flow" in wanted:
        how = parameters["flow"]
        strain = how["strain"] + how["discard"]
        each = [fast + slow / rate ** how["alpha"] if rate else _MINIMUM_TIME / how["step"] for rate in how["rates"]]
        seconds += sum(each) * strain * (1 if how["last"] else states)
    if "oscillation" in wanted:
        how = parameters["oscillation"]
        alpha, fast, slow = how["alpha"], *_CYCLE_TIME
        drag = [omega**alpha * a ** (alpha - 1) for omega in how["omega"] for a in how["amplitudes"]]  # omega tau_alpha
        seconds += sum(fast + slow / d for d in drag) * how["cycles"] * states
    if "creep" in wanted:
        how = parameters["creep"]
        seconds += _CREEP_TIME * how["duration"] * len(how["stresses"]) * states
    laws = sum(map(len, parameters["damping"].values())) if seconds else 0
    return float(laws * seconds * (parameters["n"] / 256) ** _FLOW_GROWTH)


@cache
def machine_speed() -> float:
    """CPU time of measurements of a crystal of disks on this machine, over that where times were measured.

    It takes a few tenths of a second. Other programs that run now slow it down just as they slow down tasks.
    """
    rows = np.arange(_CRYSTAL)
    height = np.sqrt(0.75)
    x = np.add.outer(0.5 * (rows % 2), rows).ravel()
    y = np.repeat(rows * height, _CRYSTAL)
    box = _CRYSTAL * np.diag([1.0, height])
    shrink = 0.99  # so that neighbours overlap
    crystal = Packing("sp", shrink * box, shrink * np.column_stack([x, y]), {"eps": 1.0}, diameters=np.ones(len(x)))
    with threadpool_limits(1):
        measure(crystal)  # loads the solvers
        began = time.process_time()
        for _ in range(_MEASUREMENTS):
            measure(crystal)
    return (time.process_time() - began) / _CRYSTAL_TIME


def task_bytes(parameters: dict[str, Any]) -> int:
    """Estimate the size of the file of one task."""
    n, states = parameters["n"], state_count(parameters)
    positions = n if parameters["model"] == "sp" else _VERTICES * n
    laws = _count_laws(parameters)
    rows = _row_bytes("spectra") * laws * len(parameters.get("omega", ()))
    rows += _row_bytes("correlation") * laws * len(parameters.get("correlation_omega", ())) * np.sqrt(n)
    rows += _row_bytes("voids") * n * ("voids" in parameters["observables"])
    if "modes" in parameters["observables"]:
        rows += _row_bytes("modes") * sum(map(len, parameters["damping"].values())) * 2 * positions
    return int(_FILE_BYTES + states * (_POSITION_BYTES * positions + _STATE_BYTES + rows))


def _row_bytes(table: str) -> int:
    return sum(kind.itemsize for kind in SCHEMA[table].values())


def _count_laws(parameters: dict[str, Any]) -> int:
    damping = parameters.get("damping", {})
    return sum(map(len, damping.values())) * len(parameters.get("prestress", ()))


def _interpolate(points: Points, n: int) -> float:
    """Interpolate linearly in log n and log t; beyond the last point, extrapolate."""
    x, y = np.log(np.array(points)).T
    slope = (y[-1] - y[-2]) / (x[-1] - x[-2])
    beyond = max(0.0, np.log(n) - x[-1]) * slope
    return float(np.exp(np.interp(np.log(n), x, y) + beyond))
