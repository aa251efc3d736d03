"""Shear a packing at a constant rate, from rest through start-up into steady flow."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from jamlab.checks import check_number, checked, is_number
from jamlab.errors import InputError
from jamlab.flow.flow_run import Progress
from jamlab.flow.overdamped_session import background_drag
from jamlab.flow.quasistatic_shear import quasistatic_shear
from jamlab.flow.recording import Recording
from jamlab.flow.run_file import RunFile
from jamlab.flow.shear_run import ShearRun
from jamlab.packing.packing import Packing
from jamlab.rheology.damping import ContactDamping, Damping

TOLERANCE = 1e-2  # relative error of velocities in a step: the stress of steady flow is known to 2 % seldom enough
MOST_ROWS = 1_000_000
LARGEST_STRAIN = 1e4
LARGEST_RATE = 1e3  # 1/tau_1; disks pass through each other long before


@checked
def shear(
    packing: Packing,
    rate: float,
    strain: float = 1.0,
    damping: Damping | None = None,
    *,
    step: float = 1e-4,
    rows: int = 200,
    frames: float | None = None,
    tolerance: float = TOLERANCE,
    background: float | None = None,
    out: str | Path | None = None,
    progress: Progress | None = None,
) -> ShearRun:
    """Shear a packing along x of the box at a constant rate, without inertia: drag always balances elastic forces.

    B u = F - rate b for the velocities u beside the affine flow, with B and b of `dynamical_matrices` at the present
    positions; Durian, Phys. Rev. E 55, 1739 (1997); drag as in Baumgarten & Tighe.

    >>> r = jamlab.shear(jamlab.pack(n=32, pressure=1e-2, seed=1), rate=1.0, strain=0.05, rows=5)
    >>> r.strain.round(6), r.packing.converged
    (array([0.  , 0.01, 0.02, 0.03, 0.04, 0.05]), False)

    Args:
        packing: SP or DP, usually at a minimum.
        rate: of strain, 1/tau_1. 0: quasi-static shear, a minimum after every `step`.
        strain: at the end.
        damping: `ContactDamping` (default, beta = 1), linear or a power law, or `StokesDrag`.
        step: of strain, at rate 0.
        rows: equal strains between the rows of the result; a few more where `frames` asks for it.
        frames: strain between two packings that are kept; it must divide `strain`. By default first and last are.
        tolerance: relative error of velocities that a step may make, from 1e-9 to 0.1. The steps follow; so does the
            residual that the solver leaves. Stresses of a smooth flow err by about as much; where contacts open and
            close, paths part, and means agree. A new contact is a jump of velocities, for which no step gets shorter
            than 0.01 tau_1; below 1e-6 that shrinks as the root of the tolerance. The result says how well energy is
            balanced: of droplets with contact drag, whose vertices slip in jumps, to 20 % at rate 0.1 and to 1 % at
            0.01.
        background: drag of every particle against the affine flow beside contact damping, over k tau_1; 0: none. In
            flow contacts leave motion that costs hardly any drag and that no step resolves. 1e-4, the default for
            disks, carries that and moves stresses by less than 1e-3; 1e-2, for drag without sliding and high rates, by
            less than 3 %. 1e-2 is the default for droplets, whose vertices slip past each other.
        out: HDF5 file of the run, see `jamlab.read_flow`: brought up to date on the way. If it holds a part of the same
            run, go on from there.
        progress: called after each row.

    Raises:
        InputError: a value out of range.
        ConvergenceError: the flow is too fast or drag too weak to be resolved; strain and remedy are named.
        StorageError: `out` cannot be written.
    """
    law = damping or ContactDamping()
    background = background_drag(packing, law, background)
    _check_rate(rate)
    check_number("strain", strain, LARGEST_STRAIN)
    if not 1 <= rows <= MOST_ROWS:
        raise InputError(f"rows = {rows}: must lie between 1 and {MOST_ROWS}")
    every = _rows_per_frame(strain, frames, rows)
    if rate == 0:
        return quasistatic_shear(packing, strain, step, every=frames, out=out, progress=progress)
    count = every * round(strain / frames) if frames else every
    interval = strain / count / rate
    file = RunFile(out, ShearRun, packing, law, {"rate": rate, "tolerance": tolerance, "background": background})
    with Recording(packing, law, tolerance, background, file.before) as flow:

        def result() -> ShearRun:
            return ShearRun(**flow.content(), shear_rate=rate, strain_asked=strain)

        flow.drive(f"rate {rate:.17g}", interval)
        while (reached := flow.rows[-1].strain) < strain * (1 - 1e-9):
            row = round(reached / strain * count) + 1
            reached = flow.advance(keep=frames is not None and row % every == 0).strain
            file.save(result)
            if progress is not None:
                progress(f"strain {reached:.3g}", reached / strain)
        found = result()
    file.save(lambda: found, now=True)
    return found


def check_rates(rates: Sequence[float]) -> list[float]:
    """Rates from the fastest to the slowest, each once.

    Raises:
        InputError: none, or one that is not positive or too large.
    """
    values = sorted({float(rate) for rate in rates}, reverse=True)
    if not values or not all(0 < rate <= LARGEST_RATE for rate in values):
        raise InputError(f"rates = {list(rates)!r}: give one or more, above 0 and at most {LARGEST_RATE:g}, in 1/tau_1")
    return values


def _check_rate(rate: float) -> None:
    if not (is_number(rate) and 0 <= rate <= LARGEST_RATE):
        raise InputError(f"rate = {rate!r}: must be a number from 0 to {LARGEST_RATE:g}, in 1/tau_1")


def _rows_per_frame(strain: float, frames: float | None, rows: int) -> int:
    if frames is None:
        return rows
    check_number("frames", frames, strain)
    if abs(strain / frames - round(strain / frames)) > 1e-6:
        raise InputError(f"frames = {frames:g} must divide strain = {strain:g}: give a strain between two packings")
    return int(np.ceil(rows * frames / strain))
