"""Athermal quasi-static shear: small steps of strain, each to an energy minimum; the limit of a vanishing rate.

Between plastic events a packing follows one minimum, and stress is elastic. Where that minimum ends, the packing falls
into another one: stress drops and energy is released at once (Maloney & Lemaitre, Phys. Rev. E 74, 016118 (2006)).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from jamlab.checks import check_number, checked
from jamlab.engine.session import Session
from jamlab.errors import InputError
from jamlab.flow.flow_run import Progress
from jamlab.flow.quasistatic_run import QuasistaticShear
from jamlab.flow.quasistatic_walk import Walk
from jamlab.flow.run_file import RunFile
from jamlab.packing.packing import Packing
from jamlab.protocols.compression import LARGEST_TOLERANCE
from jamlab.protocols.relaxation import check_tolerance

LARGEST_STRAIN, LARGEST_STEP = 1e3, 0.1


@checked
def quasistatic_shear(
    packing: Packing,
    strain: float,
    step: float = 1e-3,
    *,
    resolution: float | None = None,
    every: float | None = None,
    tolerance: float | None = None,
    out: str | Path | None = None,
    progress: Progress | None = None,
) -> QuasistaticShear:
    """Shear a packing at fixed area without rate: after every step of strain an energy minimum.

    A step moves box and positions affinely, x -> x + step y, and relaxes. The box flips to the same lattice with
    another tilt when it leans by more than 0.55 of its width, so that strain has no limit. The start is relaxed too.

    >>> r = jamlab.shear(jamlab.pack(n=32, pressure=1e-2, seed=1), rate=0, strain=0.01, step=2e-3)
    >>> r.strain.round(6), bool(r.converged.all())
    (array([0.   , 0.002, 0.004, 0.006, 0.008, 0.01 ]), True)

    Args:
        packing: SP or DP.
        strain: in all, up to 1000.
        step: at most 0.1; equal steps that are no longer than this end at `strain`. An event whose stress drop is
            smaller than the elastic rise in a step is not seen.
        resolution: on an event go back and take half the step, again and again, until steps are no longer than this:
            strain and size of the drop are known that well. By default steps are not refined.
        every: strain between two packings that are kept; by default first and last are.
        tolerance: on the largest force, as in `compress`.
        out: HDF5 file of the run, see `jamlab.read_flow`; if it holds a part of the same run, go on from there.
        progress: called after each step.

    Returns:
        All states. `converged` is False at those that missed the tolerance; the packing goes on from there.

    Raises:
        InputError: a number out of range.
        EngineError: LAMMPS stops, as where edges of droplets outgrow the neighbour cutoff.
    """
    check_number("strain", strain, LARGEST_STRAIN)
    check_number("step", step, min(LARGEST_STEP, strain))
    if resolution is not None:
        check_number("resolution", resolution, step)
    if every is not None:
        check_number("every", every, strain)
        if every < step:
            raise InputError(f"every = {every:g}: frames cannot be closer than the step, {step:g}")
    check_tolerance(tolerance, LARGEST_TOLERANCE)
    count = int(np.ceil(strain / step - 1e-9))
    task = {"rate": 0, "step": strain / count, "resolution": resolution, "tolerance": tolerance}
    file = RunFile(out, QuasistaticShear, packing, None, task)
    before = file.before
    with Session(before.packing if before else packing) as session:
        walk = Walk(session, tolerance, strain / count if resolution is None else resolution, before)

        def result() -> QuasistaticShear:
            return walk.result(strain)

        for k in range(1, count + 1):
            reached = strain * k / count
            if reached < walk.states[-1].strain + 0.5 * strain / count:
                continue  # done by the run before
            walk.go_to(reached)
            if every is not None and int(reached / every + 1e-9) > int(strain * (k - 1) / count / every + 1e-9):
                walk.keep()
            file.save(result)
            if progress is not None:
                progress(f"strain {reached:.3g}", k / count)
        found = result()
    file.save(lambda: found, now=True)
    return found
