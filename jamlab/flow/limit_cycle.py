"""Cyclic quasi-static shear: what each cycle changes, cycles that repeat, and the pairs of events within them.

A packing of finite size under cyclic shear without temperature returns, at a small amplitude, to a state that
it had one or more cycles before, and from there on all repeats (Regev, Lookman & Reichhardt, Phys. Rev. E 88, 062401
(2013); Fiocco, Foffi & Sastry, Phys. Rev. E 88, 020301 (2013)). The number of cycles between the two is the period
(Lavrentovich, Liu & Nagel, Phys. Rev. E 96, 020101 (2017)). Within such a limit cycle an event of the way there and one
of the way back that undoes it are a hysteron (Mungan et al., Phys. Rev. Lett. 123, 178002 (2019); Lindeman & Nagel,
arXiv:2403.01679).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from jamlab.arrays import Array, Indices, Mask
from jamlab.geometry.contact_network import contacts
from jamlab.motion.between_states import box_gradient
from jamlab.packing.natural_units import mean_size
from jamlab.packing.neighbors import shortest_images
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, merged_line, positive
from jamlab.plotting.palette import BLUE, GREEN, RED


@dataclass(frozen=True)
class Returns:
    """From where on two states are one, and two events are one hysteron."""

    near: float = 1e-7  # largest distance of a particle that is no rattler, mean particle size
    alike: float = 1e-6  # relative difference of energies from which on positions are not compared
    undone: float = 0.5  # -2 a.b/(|a|^2 + |b|^2) of the displacements a, b of two events that undo each other


RETURNS = Returns()


@dataclass(frozen=True)
class Hysterons(Result):
    """Hysterons of a limit cycle, h of them: pairs of plastic events, of which the second undoes the first.

    Attributes:
        on: (h,) strain at which the event of growing strain happens.
        off: (h,) strain at which the event of falling strain happens.
        width_on: (h,) strain of the step of the first: it lies that much below `on` at most.
        width_off: (h,) strain of the step of the second: it lies that much above `off` at most.
        size: (h,) root of the sum over particles of the squared displacement of the first, in the unit of length.
        reversal: (h,) -2 a.b/(|a|^2 + |b|^2) of the displacements a and b of the two: 1 if one undoes the other.
        unpaired: number of events of the limit cycle that no other undoes alone, such as avalanches.
    """

    _rows = ("on", "off", "width_on", "width_off", "size", "reversal")

    on: Array
    off: Array
    width_on: Array
    width_off: Array
    size: Array
    reversal: Array
    unpaired: int = 0

    def __len__(self) -> int:
        return len(self.on)

    @property
    def hysteresis(self) -> Array:
        """(h,) width of the hysteresis, `on` less `off`."""
        return np.asarray(self.on - self.off)

    @drawn("Line2D")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw the strain at which each hysteron switches off against the strain at which it switches on: the Preisach
        plane, in which all lie below the diagonal."""
        name = f"{len(self)} hysteron{'s' * (len(self) != 1)}, {self.unpaired} events without a partner"
        look = {"color": BLUE, "marker": "o", "linestyle": "", "markersize": 5, "label": name}
        axes.plot(self.on, self.off, **merged_line(look, style))
        if len(self):
            ends = [min(self.on.min(), self.off.min()), max(self.on.max(), self.off.max())]
            axes.plot(ends, ends, color=GREEN, linestyle="--", linewidth=0.8)
        label_axes(axes, r"switches on at strain $\gamma^+$", r"switches off at strain $\gamma^-$")
        axes.legend(fontsize=LEGEND)


@dataclass(frozen=True)
class LimitCycle(Result):
    """Part of a cyclic shear that repeats.

    Attributes:
        period: number of cycles until the state returns.
        cycles_before: number of cycles before it, of the transient.
        distance: largest distance of a particle that is no rattler between the state that returned and the earlier
            one, in units of the mean particle size; of packings that are unjammed, of any particle.
        dissipated: energy that one period dissipates, over the area at the start.
        events: number of plastic events of one period.
        rows: (2,) rows of the run at which the last period begins and ends.
        hysterons: pairs of these events.
    """

    period: int
    cycles_before: int
    distance: float
    dissipated: float
    events: int
    rows: Indices
    hysterons: Hysterons = field(repr=False)


@dataclass(frozen=True)
class ShearCycles(Result):
    """Cycles of a quasi-static shear, c of them, each from one end to the next.

    Attributes:
        cycle: (c,) number of the cycle, from 1.
        displacement: (c,) mean distance of the particles between its begin and its end, in the unit of length; without
            rattlers, and without the motion of all together. Of packings that are unjammed, of all particles.
        largest: (c,) largest of these distances.
        displacements: (c, n, 2) displacement of each particle, of rattlers too.
        dissipated: (c,) energy dissipated over the area at the start, the area of the loop of stress over strain.
        events: (c,) number of plastic events.
        unit: of length, for labels.
        period: number of cycles until the state returned, 0 if it did not.
    """

    _rows = ("cycle", "displacement", "largest", "dissipated", "events")
    _apart = ("displacements",)

    cycle: Indices
    displacement: Array
    largest: Array
    displacements: Array = field(repr=False)
    dissipated: Array
    events: Indices
    unit: str = field(repr=False)
    period: int

    def __len__(self) -> int:
        return len(self.cycle)

    @drawn("Line2D")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw the mean displacement a cycle over the number of the cycle; marked: the limit cycle."""
        shown, left_out = positive(self.displacement)
        look = {"color": BLUE, "marker": "o", "markersize": 4, "label": "mean of the particles" + left_out}
        axes.semilogy(self.cycle, shown, **merged_line(look, style))
        if self.period:
            last = slice(len(self) - self.period, None)
            name = f"limit cycle of period {self.period}"
            axes.semilogy(self.cycle[last], shown[last], "o", color=RED, markersize=7, fillstyle="none", label=name)
        label_axes(axes, "cycle", in_unit("displacement a cycle", self.unit))
        axes.xaxis.get_major_locator().set_params(integer=True)
        axes.legend(fontsize=LEGEND)


@dataclass(frozen=True)
class Moved:
    """How far all sites moved between two states of a run at one strain."""

    sites: Array  # (n_sites, 2) shortest displacements, without the common motion of the particles that count
    counted: Mask  # (n,) free particles that are no rattlers in both; all free ones, if there are none
    before: Packing

    @property
    def particles(self) -> Array:
        """(n, 2) displacements of the particles."""
        particle = self.before.particle
        sums = [np.bincount(particle, along, self.before.n) for along in self.sites.T]
        return np.asarray(np.transpose(sums) / np.bincount(particle, minlength=self.before.n)[:, None])

    @property
    def lengths(self) -> Array:
        """Distances of the particles that count."""
        return np.asarray(np.hypot(*self.particles[self.counted].T))

    @property
    def distance(self) -> float:
        """Largest distance of a site of a particle that counts, over the mean size."""
        sites = self.sites[self.counted[self.before.particle]]
        return float(np.hypot(*sites.T).max(initial=0.0)) / mean_size(self.before)


def moved_between(before: Packing, after: Packing) -> Moved:
    """How far all moved between two states at one strain."""
    free, frame = before.frame.free, before.frame
    counted = free & ~(contacts(before).rattlers | contacts(after).rattlers)
    counted = counted if counted.any() else free
    sites = after.positions - before.positions @ box_gradient(before, after).T
    if frame.all_free or frame.slips:  # the whole may have moved
        sites = sites - _common(sites, counted[before.particle], before)
    sites = sites - shortest_images(sites, after.box) @ after.box
    return Moved(sites - _common(sites, counted[before.particle], before), counted, before)


def _common(moved: Array, counted: Mask, packing: Packing) -> Array | float:
    """Motion of all together, from the sites that count."""
    return packing.frame.drift(np.where(counted[:, None], moved, moved[counted].mean(axis=0)))


def plastic_displacements(before: Packing, after: Packing) -> Array:
    """(n, 2) displacement of particles by a plastic event, between two minima at one strain; 0 of rattlers."""
    moved = moved_between(before, after)
    return np.where(moved.counted[:, None], moved.particles, 0.0)


def earlier_state(ends: list[Packing], energy: Array, noise: float) -> tuple[int, float]:
    """Number of cycles since the last of some states (c,) was there before, and how near it comes; 0 and nan if it was
    not. `energy`: (c,) of these states; `noise`: what residual forces leave of one, all that there is of unjammed
    packings."""
    last = len(ends) - 1
    near = np.abs(energy[:-1] - energy[-1]) <= np.maximum(RETURNS.alike * np.abs(energy[-1]), noise)
    for k in np.flatnonzero(near)[::-1]:
        if (distance := moved_between(ends[k], ends[last]).distance) <= RETURNS.near:
            return last - int(k), distance
    return 0, float("nan")


def pair_events(strain: Array, step: Array, displacements: Array) -> Hysterons:
    """Pair m events of a limit cycle that undo each other.

    Args:
        strain: (m,) at the end of the step of each event.
        step: (m,) strain of the step, with its sign.
        displacements: (m, n, 2) of the particles.
    """
    from scipy.optimize import linear_sum_assignment

    up, down = np.flatnonzero(step > 0), np.flatnonzero(step < 0)
    moved = displacements.reshape(len(strain), 2 * displacements.shape[1])
    square = (moved**2).sum(axis=1)
    both = square[up][:, None] + square[down]
    reversal = np.divide(-2 * moved[up] @ moved[down].T, both, out=np.zeros_like(both), where=both > 0)
    reversal[strain[up][:, None] <= strain[down]] = 0.0  # a hysteron stays on until the strain has fallen
    one, other = linear_sum_assignment(-reversal)
    kept = reversal[one, other] >= RETURNS.undone
    i, j = up[one[kept]], down[other[kept]]
    found = {"on": strain[i], "off": strain[j], "width_on": step[i], "width_off": -step[j]}
    size, undone = np.sqrt(square[i]), reversal[one, other][kept]
    return Hysterons(**found, size=size, reversal=undone, unpaired=len(strain) - 2 * len(i))
