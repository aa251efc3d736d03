"""Athermal quasi-static shear: small steps of strain, each to an energy minimum; the limit of a vanishing rate.

Between plastic events a packing follows one minimum, and stress is elastic. Where that minimum ends, the packing falls
into another one: stress drops and energy is released at once (Maloney & Lemaitre, Phys. Rev. E 74, 016118 (2006)).
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from jamlab.arguments.choices import Direction, HeldPressure
from jamlab.checks import checked, is_number
from jamlab.errors import InputError, named
from jamlab.flow.event_bracket import BracketedWalk, check_event_width
from jamlab.flow.quasistatic_run import QuasistaticShear
from jamlab.flow.quasistatic_walk import Shearing, Walk
from jamlab.flow.shear_jamming import BRACKET
from jamlab.flow.strain_path import strain_path
from jamlab.geometry.contact_network import contacts
from jamlab.geometry.walls import walled
from jamlab.packing.natural_units import natural_scales
from jamlab.packing.packing import Packing
from jamlab.packing.shear_direction import shear_direction
from jamlab.processes.progress import Progress

_HIGHEST_PRESSURE = 1.0  # that may be held, stiffness of a contact


@checked
def quasistatic_shear(
    packing: Packing,
    strain: float | Sequence[float],
    strain_step: float = 1e-3,
    *,
    cycles: int | None = None,
    direction: Direction = "simple",
    walls: bool | None = None,
    pressure: HeldPressure | None = None,
    until_jammed: bool = False,
    snapshot_every: float | None = None,
    event_width: float | None = None,
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
    >>> p = jamlab.pack(n=16, pressure=1e-2, seed=2)
    >>> c = jamlab.quasistatic_shear(p, strain=[0.03, -0.03, 0.03], strain_step=6e-3, cycles=20)
    >>> c.state, c.limit_cycle and c.limit_cycle.period, bool(c.cycles.largest[-1] < 1e-9)
    ('periodic', 1, True)

    Args:
        packing: SP or DP.
        strain: total strain of either sign, up to 1000 for "simple", up to 1 for other directions. Or turning points,
            which are visited one after the other, such as [0.05, -0.05, 0.05].
        strain_step: largest strain step, at most 0.1. Events in which stress rises, and less than 2 % of the work of
            the step is lost, are not detected.
        cycles: visit the turning points up to this many times. A cycle ends at the last one of them; the shear stops
            as soon as the state there is that of an earlier cycle, since the cycles in between repeat for ever. Two
            states are one if no particle, rattlers left out, is 1e-7 of the mean size off. Default: visit them once.
        direction: "simple": along x; an angle in radians: simple shear in that direction; "pure": extension along x,
            compression along y. `stress` is conjugate to the strain. Between walls only "simple".
        walls: see `shear`.
        pressure: "constant" (initial pressure) or a number in the packing's unit of stress: every state minimises the
            enthalpy over the area too, and meets the pressure to 1e-9 of itself or 3e-15 of the stiffness of a contact;
            that of sticky disks, which may vanish, to 1e-9 of the mean contact force over the mean size. A packing of
            repulsive particles that unjams is compressed until it jams, and then decompressed. Between walls the
            pressure is the normal stress on them, at constant width, and strains are over the height at the start.
            Default: constant area.
        until_jammed: True: shear a packing that is unjammed until it jams, and stop there. The step that jams it is
            halved until it is a thousandth of `strain_step`. Default: False.
        snapshot_every: strain between stored packings, both directions added. Default: only the first, the last and
            those at the ends of cycles.
        event_width: strain to which each plastic event is bracketed, by halving the step that holds it; a step that
            holds several finds each of them. Missed are those that a step back undoes, and that lose less energy per
            area than 5 % of half the strain times the change of stress in the step, or than 5e-5 of stiffness times
            `strain_step` squared. The packings on both sides are kept. Default: events are known to a step.
        force_tolerance: largest residual force in natural units, as in `compress`.
        path, progress: see `shear`.

    Returns:
        All states. `converged` is False for states that missed the force tolerance; the shear continues from them.
        `cycles` has the displacement a cycle, `limit_cycle` period, cycles before it and hysterons, `jamming` the
        strain at which the packing jams.
    """
    packing = walled(packing, walls)
    shearing = Shearing(packing.box[0], shear_direction(packing, direction))
    route = strain_path(strain, strain_step, cycles, snapshot_every)
    largest = max(route.points, key=abs)
    if abs(largest) > 1 and not shearing.along_x:
        raise InputError(f"{named('strain', largest)}: must be at most 1 in magnitude for direction {direction!r}")
    _check_pressure(packing, pressure)
    if until_jammed:
        _check_may_jam(packing, pressure)
    task: dict[str, Any] = {"strain_step": float(f"{route.step:.12g}")}  # whatever part of the strain it is
    if route.turns:
        task = {"strain_step": strain_step, "turning_points": route.points}
    task |= {} if shearing.along_x else {"direction": direction}
    task |= {} if pressure is None else {"pressure": pressure}
    if pressure is not None and packing.frame.has_walls:  # runs by the present height are others
        task |= {"strain_over": "height at the start"}
    task |= {"until_jammed": True} if until_jammed else {}
    if event_width is not None:
        check_event_width(packing, event_width, abs(route.step), largest, force_tolerance)
        if until_jammed:
            raise InputError(
                f"until_jammed = True, {named('event_width', event_width, 'g')}: a packing that is unjammed has no "
                "plastic events; leave one of the two out"
            )
        task["event_width"] = event_width
    how = (packing, shearing, force_tolerance, pressure, task, path, progress)
    with Walk(*how) if event_width is None else BracketedWalk(event_width, route.step, *how) as walk:
        walk.facts |= {"strain_asked": route.length, "direction": direction, "until_jammed": until_jammed}
        walk.follow(route, BRACKET.width * strain_step if until_jammed else None)
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


def _check_may_jam(packing: Packing, pressure: HeldPressure | None) -> None:
    """Refuse what is not unjammed at first, and jammed at last."""
    if pressure is not None:
        raise InputError(
            f"until_jammed = True, pressure = {pressure!r}: a packing under pressure is jammed at every strain; leave "
            "one of the two out"
        )
    if packing.law.range:
        raise InputError(
            f"until_jammed = True: particles that attract ({packing.law.name}) bear stress before they jam; use "
            "repulsive particles, or leave until_jammed out"
        )
    if not contacts(packing).unjammed:
        raise InputError(
            f"until_jammed = True: the packing is jammed at phi = {packing.phi:.6g} before it is sheared; use one "
            "below its jamming onset, or leave until_jammed out"
        )
