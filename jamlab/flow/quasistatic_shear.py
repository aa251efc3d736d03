"""Athermal quasi-static shear: small steps of strain, each to an energy minimum; the limit of a vanishing rate.

Between plastic events a packing follows one minimum, and stress is elastic. Where that minimum ends, the packing falls
into another one: stress drops and energy is released at once (Maloney & Lemaitre, Phys. Rev. E 74, 016118 (2006)).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from jamlab.arguments.choices import Direction, HeldPressure
from jamlab.checks import check_number, checked, is_number
from jamlab.errors import InputError, named
from jamlab.flow.quasistatic_run import QuasistaticShear
from jamlab.flow.quasistatic_walk import Shearing, Walk
from jamlab.geometry.walls import walled
from jamlab.packing.natural_units import natural_scales
from jamlab.packing.packing import Packing
from jamlab.packing.shear_direction import shear_direction
from jamlab.processes.progress import Progress
from jamlab.protocols.compression import MOST_STATES

_HIGHEST_PRESSURE = 1.0  # that may be held, stiffness of a contact


@checked
def quasistatic_shear(
    packing: Packing,
    strain: float,
    strain_step: float = 1e-3,
    *,
    direction: Direction = "simple",
    walls: bool | None = None,
    pressure: HeldPressure | None = None,
    snapshot_every: float | None = None,
    force_tolerance: float | None = None,
    path: str | Path | None = None,
    progress: Progress | None = None,
) -> QuasistaticShear:
    """Shear a packing quasi-statically, with an energy minimum after every strain step, at fixed area or pressure.

    Each step moves box and positions affinely, x -> x + strain_step y, and relaxes. A box tilted by more than 0.55 of
    its width is replaced by an equivalent box, so the strain is unlimited. The initial packing is relaxed too. For
    other directions, packings are rotated so that the first box vector stays along x.

    >>> r = jamlab.quasistatic_shear(jamlab.pack(n=32, pressure=1e-2, seed=1), strain=0.01, strain_step=2e-3)
    >>> r.strain.round(6), bool(r.converged.all())
    (array([0.   , 0.002, 0.004, 0.006, 0.008, 0.01 ]), True)

    Args:
        packing: SP or DP.
        strain: total strain of either sign, up to 1000 for "simple", up to 1 for other directions.
        strain_step: largest strain step, at most 0.1. Events in which stress rises, and less than 2 % of the work of
            the step is lost, are not detected.
        direction: "simple": along x; an angle in radians: simple shear in that direction; "pure": extension along x,
            compression along y. `stress` is conjugate to the strain. Between walls only "simple".
        walls: see `shear`.
        pressure: "constant" (initial pressure) or a number in the packing's unit of stress: every state minimises the
            enthalpy over the area too, and meets the pressure to 1e-9 of itself or 3e-15 of the stiffness of a contact;
            that of sticky disks, which may vanish, to 1e-9 of the mean contact force over the mean size. A packing of
            repulsive particles that unjams is compressed until it jams, and then decompressed. Between walls the
            pressure is the normal stress on them, at constant width. Default: constant area.
        snapshot_every: strain between stored packings. Default: only the first and the last.
        force_tolerance: largest residual force in natural units, as in `compress`.
        path, progress: see `shear`.

    Returns:
        All states. `converged` is False for states that missed the force tolerance; the shear continues from them.
    """
    packing = walled(packing, walls)
    shearing = Shearing(packing.box[0], shear_direction(packing, direction))
    whole = abs(strain)
    if whole == 0:
        raise InputError(f"{named('strain', strain)}: must be other than 0")
    if whole > 1 and not shearing.along_x:
        raise InputError(f"{named('strain', strain)}: must be at most 1 in magnitude for direction {direction!r}")
    check_number("strain_step", strain_step, whole, whole / MOST_STATES)
    if snapshot_every is not None:
        check_number("snapshot_every", snapshot_every, whole)
        if snapshot_every < strain_step:
            raise InputError(
                f"{named('snapshot_every', snapshot_every, 'g')}: closer than strain_step = {strain_step:g}"
            )
    _check_pressure(packing, pressure)
    count = int(np.ceil(whole / strain_step - 1e-9))
    task: dict[str, Any] = {"strain_step": strain / count}
    task |= {} if shearing.along_x else {"direction": direction}
    task |= {} if pressure is None else {"pressure": pressure}

    def kept(k: int) -> int:
        return int(whole * k / count / snapshot_every + 1e-9) if snapshot_every is not None else 0

    with Walk(packing, shearing, force_tolerance, pressure, task, path, progress) as walk:
        walk.facts |= {"strain_asked": whole, "direction": direction}
        walk.warn_beyond("strain", abs(walk.rows[-1].strain), whole)
        for k in range(1, count + 1):
            reached = strain * k / count
            if abs(reached) < abs(walk.rows[-1].strain) + 0.5 * whole / count:
                continue  # done by the run before
            walk.go_to(reached, keep=kept(k) > kept(k - 1))
            walk.report(k / count, f"strain {reached:.3g}")
        return walk.finish()


def _check_pressure(packing: Packing, pressure: HeldPressure | None) -> None:
    """Refuse what is no pressure that the packing can be held at."""
    if pressure is None or pressure == "constant":
        return
    largest = _HIGHEST_PRESSURE * natural_scales(packing).stress  # beyond, particles pass through each other
    known = not isinstance(pressure, str) and is_number(pressure) and abs(pressure) <= largest
    if not known or (pressure <= 0 and not packing.law.range):
        raise InputError(
            f'pressure = {pressure!r}: give "constant", or a number of at most {largest:g} '
            f"{packing.unit_names.stress}, positive for repulsive particles"
        )
