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

    B u = F - rate b for the velocities u beside the affine flow, with B and b of `dynamical_matrices` at the present
    positions; Durian, Phys. Rev. E 55, 1739 (1997); drag as in Baumgarten & Tighe.

    >>> r = jamlab.shear(jamlab.pack(n=32, pressure=1e-2, seed=1), rate=1.0, strain=0.05, n_rows=5)
    >>> r.strain.round(6), r.packing.converged
    (array([0.  , 0.01, 0.02, 0.03, 0.04, 0.05]), False)
    >>> r = jamlab.shear(jamlab.pack(n=32, pressure=1e-2, seed=1), [(1.0, 0.04), (-1.0, 0.02)], n_rows=6)  # reversal
    >>> r.strain.round(6)
    array([0.  , 0.01, 0.02, 0.03, 0.04, 0.03, 0.02])

    Args:
        packing: SP or DP, usually at a minimum.
        rate: of strain, 1/tau_1, negative for the other way. Or the parts of a protocol, [(rate, strain), ...] or an
            array (p, 2), one after the other: each shears by its strain, given without sign.
        strain: by which to shear, default 1; of a protocol its parts say it.
        damping: `ContactDamping` (default, beta = 1), linear or a power law, or `StokesDrag`.
        step: of `quasistatic_shear`, which rate 0 stood for.
        n_rows: equal strains between the rows of the result; a few more where `snapshot_every` asks for it.
        snapshot_every: strain between two packings that are kept; it must divide `strain`. By default first and last
            are.
        tolerance: relative error of velocities that a step may make, from 1e-9 to 0.1. Velocities jump
            where contacts open and close, and steps end there; stresses over the largest one err by less than the
            tolerance, except for the few rows next to a jump. Where drag would push a contact open that closes
            without it, the two disks rub: their gap stays zero, and as much of the drag acts as keeps it so. Steps of
            droplets end at no contact, and lose energy there: the result says how well energy is balanced. Line tension
            of their edges fades below tolerance delta/100: edges that shrink to a point turned round in every step.
        background_drag: drag of every particle against the affine flow beside contact damping, over k tau_1; 0: none.
            Contacts leave some motion without drag, as of a disk on one contact, and the law does not determine it:
            the background does. Its choice is part of the model: flows with 0 and 1e-5 take paths that differ by 9 % of
            the stress (N = 16), though their means agree within their errors. 1e-4 is the default for disks, 1e-2 for
            droplets, whose vertices slip past each other; 1e-2 moves the mean stress of disks by less than 3 %.
        walls: True: between the walls of `jamlab.with_walls`, the upper one of which moves by strain times
            height of the box; False: take the walls away. By default the walls of the packing stay.
        path: HDF5 file of the run, see `jamlab.read_flow`: brought up to date on the way. If it holds a part of the
            same run, the run resumes; a run that went as far or farther is returned with its rows and frames.
        progress: called after each row with the share of the work that is done, and in words.

    Raises:
        InputError: a value out of range.
        ConvergenceError: the flow is too fast or drag too weak to be resolved, or it would take more than 1e8 steps;
            strain and remedy are named.
        StorageError: `path` cannot be written, or holds anything but a part of this run.
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
