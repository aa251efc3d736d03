"""Plastic events between two minima of quasi-static shear, each bracketed by halving the step that holds it.

A step in which stress falls or energy is lost is halved, from the last minimum before it on, until it is at most as
long as the width asked for. There it is an event if the step back does not lead back; the minima on its two sides are
rows of the run. The rest of the step begins behind the event, so that each of several events in it is found.

Source: Maloney & Lemaitre, Phys. Rev. E 74, 016118 (2006), who shorten steps at drops of the stress.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from jamlab.errors import InputError, named
from jamlab.flow.flow_run import FLOW_ENERGY
from jamlab.flow.quasistatic_run import QuasistaticShear, noise_of_stress
from jamlab.flow.quasistatic_walk import Minimum, Walk
from jamlab.packing.packing import Packing
from jamlab.protocols.relaxation import usual_force_tolerance


@dataclass(frozen=True)
class Bracketing:
    """From where on a step is halved, and how far."""

    # energy per area that is looked for where a step loses more: as part of its own elastic energy, half of its strain
    # times its change of stress, and over stiffness times square of the longest step, half of it. The trapezoidal rule
    # loses some where contacts change, as the square of the step; events lose it at once
    lost: float = 0.05
    sought: float = 1e-4
    narrowest: float = 10.0  # width over the strain that changes a stress by its noise, stiffness of a contact
    digits: float = 256.0  # the same over the rounding of the strain


BRACKETING = Bracketing()


@dataclass(frozen=True)
class Place:
    """A minimum on the way: its row, and its packing in natural units."""

    row: Minimum
    packing: Packing


class BracketedWalk(Walk):
    """A walk whose events are bracketed, each to a strain of `event_width` or less."""

    def __init__(self, event_width: float, strain_step: float, *how: Any) -> None:
        super().__init__(*how)
        self._least = 0.5 * BRACKETING.sought * strain_step**2 * self._scales.stress
        self._inner: list[int] = [] if self.before is None else self.before.inner_rows.tolist()
        self.facts["event_width"] = event_width

    def result(self) -> QuasistaticShear:
        """All states so far."""
        self.facts["inner_rows"] = np.array(self._inner, dtype=np.int64)
        return super().result()

    def go_to(self, strain: float, *, keep: bool = False) -> None:
        """Take one step, and bracket each event in it; the packings on both sides are kept."""
        while self.rows[-1].strain != strain:
            base = Place(self.rows[-1], self._now)
            before, after = self._first_event(base, strain)
            if before is not base:
                self._put(before, strain, keep=keep or after is not None)
            elif not self._last_is_kept():
                self._kept.append(len(self.rows) - 1)
                self.frames.append(self._scales.from_natural(base.packing))
            if after is not None:
                after.row.event = True
                self._put(after, strain, keep=True)

    def _put(self, place: Place, end: float, *, keep: bool) -> None:
        """Add a row, and note if it stands within the step to a strain."""
        self._inner += [len(self.rows)] if place.row.strain != end else []
        self._now = place.packing
        self.add(place.row, keep=keep)

    def _first_event(self, before: Place, strain: float) -> tuple[Place, Place | None]:
        """The minima on both sides of the first event up to a strain; without one the minimum there, and None. Of the
        strains still to be reached, the nearest one stands last."""
        ahead = [strain]
        while ahead:
            after = self._from(before, ahead[-1])
            step = abs(ahead[-1] - before.row.strain)
            if not self._calm(before, after):
                if step > self.facts["event_width"]:
                    ahead.append(0.5 * (before.row.strain + ahead[-1]))
                    continue
                if self._loses(before, after) and self._is_event(before.packing, before.row, after.row):
                    return before, after
            before = after
            ahead.pop()
        return before, None

    def _from(self, before: Place, strain: float) -> Place:
        """The minimum that a step from another one ends in."""
        self._now = before.packing
        row = self._step(strain, strain - before.row.strain, before.row)
        return Place(row, self._now)

    def _loses(self, before: Place, after: Place) -> bool:
        """Whether a step loses energy beyond rounding."""
        old, new = before.row, after.row
        noise = self._noise(old, new) * abs(new.strain - old.strain)
        rounding = FLOW_ENERGY.rounding * (abs(new.energy) + (self._pressure or 0.0) * self._share(new.area))
        return bool(new.dissipated - old.dissipated > max(noise, rounding))

    def _calm(self, before: Place, after: Place) -> bool:
        """Whether a step is elastic as far as its energy tells, and leads back if its stress falls; the packing is at
        the state after."""
        old, new = before.row, after.row
        step, noise = abs(new.strain - old.strain), self._noise(old, new)
        seen = max(0.5 * BRACKETING.lost * abs(new.stress - old.stress), noise) * step
        if abs(new.dissipated - old.dissipated) > max(seen, self._least):
            return False
        return not self._is_event(before.packing, old, new)


def check_event_width(
    packing: Packing, event_width: float, strain_step: float, furthest: float, force_tolerance: float | None
) -> None:
    """Refuse a width that is no part of a step, or that rounding or the forces left at minima do not resolve.

    Args:
        packing: to be sheared.
        event_width: strain.
        strain_step: of the run.
        furthest: largest strain of the run.
        force_tolerance: see `quasistatic_shear`.
    """
    if event_width >= strain_step:
        raise InputError(
            f"{named('event_width', event_width, 'g')}: must be below strain_step = {strain_step:g}, which is halved "
            "to it"
        )
    force = usual_force_tolerance(packing.model) if force_tolerance is None else force_tolerance
    noise = BRACKETING.narrowest * float(noise_of_stress(force, 0.0))
    rounding = BRACKETING.digits * float(np.finfo(np.float64).eps) * abs(furthest)
    if event_width < max(noise, rounding):
        remedy = "use a larger width" if rounding > noise else f"use a larger width or force_tolerance below {force:g}"
        raise InputError(
            f"{named('event_width', event_width, 'g')}: minima do not resolve strains below "
            f"{max(noise, rounding):.2g}; {remedy}"
        )
