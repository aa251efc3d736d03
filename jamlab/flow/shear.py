"""Shear a packing at a constant rate, from rest through start-up into steady flow."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import check_number, checked, is_number
from jamlab.errors import InputError
from jamlab.flow.overdamped_session import LEAST_STRAIN, End, default_background
from jamlab.flow.quasistatic_shear import quasistatic_shear
from jamlab.flow.run import Accuracy, TimedRun
from jamlab.flow.shear_run import ShearRun
from jamlab.geometry.walls import walled
from jamlab.packing.packing import Packing
from jamlab.processes.progress import Progress
from jamlab.rheology.damping import ContactDamping, Damping

TOLERANCE = 1e-2  # relative error of velocities in a step: the stress of steady flow is known to 2 % seldom enough
ROWS = 200
STEP = 1e-4  # of strain between two minima
MOST_ROWS = 1_000_000
LARGEST_STRAIN = 1e4
LEAST_RATE, LARGEST_RATE = 1e-12, 1e3  # 1/tau_1; disks pass through each other long before


@checked
def shear(
    packing: Packing,
    rate: float | Sequence[Sequence[float]],
    strain: float | None = None,
    damping: Damping | None = None,
    *,
    step: float | None = None,
    n_rows: int = ROWS,
    snapshot_every: float | None = None,
    tolerance: float = TOLERANCE,
    background_drag: float | None = None,
    walls: bool | None = None,
    path: str | Path | None = None,
    progress: Progress | None = None,
) -> ShearRun:
    """Shear a packing along x at a constant rate (overdamped: drag balances elastic forces at all times).

    Solves B u = F - rate b for the non-affine velocities u, with B and b of `dynamical_matrices`; see Durian, Phys.
    Rev. E 55, 1739 (1997), with the drag of Baumgarten & Tighe.

    >>> r = jamlab.shear(jamlab.pack(n=32, pressure=1e-2, seed=1), rate=1.0, strain=0.05, n_rows=5)
    >>> r.strain.round(6), r.packing.converged
    (array([0.  , 0.01, 0.02, 0.03, 0.04, 0.05]), False)
    >>> r = jamlab.shear(jamlab.pack(n=32, pressure=1e-2, seed=1), [(1.0, 0.04), (-1.0, 0.02)], n_rows=6)  # reversal
    >>> r.strain.round(6)
    array([0.  , 0.01, 0.02, 0.03, 0.04, 0.03, 0.02])

    Args:
        packing: SP or DP, usually at a minimum.
        rate: shear rate, 1/tau_1; negative: reverse direction. Or a protocol of parts, [(rate, strain), ...] or an
            array (p, 2), with positive strains.
        strain: total strain, default 1; not with a protocol.
        damping: `ContactDamping` (default, beta = 1), linear or a power law, or `StokesDrag`.
        step: deprecated; see `quasistatic_shear`.
        n_rows: number of rows of the result, at equal strain intervals; more if `snapshot_every` requires it.
        snapshot_every: strain between stored packings; must divide `strain`. Default: only the first and the last.
        tolerance: relative error of velocities per step, 1e-9 to 0.1, default 1e-2. Errors of stresses are below the
            tolerance times the largest stress, except in rows next to a velocity jump. `energy_error` of the result
            measures the energy balance. For time steps and marginal contacts see docs/explanation/drag.md.
        background_drag: Stokes drag in addition to contact damping, in units of k tau_1. It determines motion that
            contact damping leaves without drag. Default: 1e-4 for disks, 1e-2 for droplets. 1e-2 changes the mean
            stress of disks by less than 3 %.
        walls: True: shear between the walls of `jamlab.with_walls`; the upper wall moves by strain times box height.
            False: remove the walls. Default: as in the packing.
        path: HDF5 file of the run, saved regularly, see `jamlab.read_flow`. If it contains a part of the same run, the
            run resumes; a complete run is returned from the file.
        progress: called after each row with (fraction done, text), or True.

    Raises:
        InputError: a value out of range.
        ConvergenceError: the flow is too fast or the drag too weak to be resolved, or it needs more than 1e8 steps.
        StorageError: `path` cannot be written, or contains another run.
    """
    packing = walled(packing, walls)
    if is_number(rate) and rate == 0:
        warnings.warn("shear(rate=0) is now quasistatic_shear(packing, strain, step)", FutureWarning, stacklevel=3)
        whole, step = 1.0 if strain is None else strain, STEP if step is None else step
        return quasistatic_shear(packing, whole, step, every=snapshot_every, path=path, progress=progress)
    if step is not None:
        raise InputError(f"step = {step!r}: only quasistatic_shear takes strain steps; leave step out")
    parts = _parts(rate, strain)
    law = damping or ContactDamping()
    if not 1 <= n_rows <= MOST_ROWS:
        raise InputError(f"n_rows = {n_rows}: must lie between 1 and {MOST_ROWS}")
    whole = float(parts[:, 1].sum())
    counts = [_rows_of_part(length, snapshot_every, n_rows * length / whole) for length in parts[:, 1]]
    several = len(parts) > 1
    task = {"rate": parts.tolist() if several else float(parts[0, 0])}
    slowest = float(np.abs(parts[:, 0]).min())
    end = End(
        float((parts[:, 1] / np.abs(parts[:, 0])).sum()),
        f"a higher rate than {slowest:g}, a smaller strain than {whole:g}, or use quasistatic_shear",
    )
    accuracy = Accuracy(law, tolerance, default_background(packing, law, background_drag))
    with TimedRun(ShearRun, packing, accuracy, task, end, path, progress) as flow:
        flow.facts |= {"shear_rate": float(parts[-1, 0]), "strain_asked": whole, "parts": parts if several else None}
        begin = 0.0
        for (speed, by), (count, every) in zip(parts, counts, strict=True):
            done = round(max(0.0, flow.path - begin) / by * count)
            if done < count:
                flow.drive(f"rate {speed:.17g}", by / count / abs(speed))
            for row in range(done + 1, count + 1):
                keep = (row == count and several) or (every > 0 and row % every == 0)
                state = flow.advance(keep=keep)
                flow.report(min(1.0, flow.path / whole), f"strain {state.strain:.3g}")
            begin += by
        return flow.finish()


def _parts(rate: float | Sequence[Sequence[float]], strain: float | None) -> Array:
    """(p, 2) rate and strain of each part."""
    if isinstance(rate, Sequence | np.ndarray):
        if strain is not None:
            raise InputError(f"strain = {strain!r}: each part of the protocol has its own strain; leave strain out")
        parts = [list(part) for part in rate]
        if not parts or any(len(part) != 2 for part in parts):
            raise InputError(f"rate = {parts!r}: give a protocol of one or more parts, [(rate, strain), ...]")
    else:
        parts = [[rate, 1.0 if strain is None else strain]]
    for speed, by in parts:
        if not (is_number(speed) and LEAST_RATE <= abs(speed) <= LARGEST_RATE):
            raise InputError(
                f"rate = {speed!r}: must be {LEAST_RATE:g} to {LARGEST_RATE:g} in magnitude, in units of 1/tau_1"
            )
        check_number("strain", by, LARGEST_STRAIN, LEAST_STRAIN)
    return np.array(parts, dtype=np.float64)


def _rows_of_part(strain: float, frames: float | None, rows: float) -> tuple[int, int]:
    """Rows of a part, and after how many of them a packing is kept; 0: none on the way."""
    count = max(1, round(rows))
    if frames is None:
        return count, 0
    check_number("frames", frames, strain)
    if abs(strain / frames - round(strain / frames)) > 1e-6:
        raise InputError(
            f"snapshot_every = {frames:g} must divide strain = {strain:g}: use an integer fraction of the strain"
        )
    every = int(np.ceil(count * frames / strain))
    return every * round(strain / frames), every


def check_rates(rates: Sequence[float]) -> list[float]:
    """Rates from the fastest to the slowest, each once."""
    values = sorted({float(rate) for rate in rates}, reverse=True)
    if not values or not all(LEAST_RATE <= rate <= LARGEST_RATE for rate in values):
        raise InputError(
            f"rates = {list(rates)!r}: give one or more from {LEAST_RATE:g} to {LARGEST_RATE:g}, in 1/tau_1"
        )
    return values
