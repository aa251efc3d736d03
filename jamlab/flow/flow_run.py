"""A run of flow in time: its rows, the packings on the way, its drag and accuracy, and its energy balance.

Work that flow does on a packing is stored or lost. Steps integrate positions, work and dissipation each on their own,
so the gap between the three measures the errors of the steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.geometry.contact_network import contacts
from jamlab.packing.packing import Packing
from jamlab.packing.short_repr import short_repr
from jamlab.plotting.drawable import LEGEND, label_axes, merged_line, positive
from jamlab.plotting.palette import BLACK, COLOURS, RED
from jamlab.rheology.damping import Damping


def check_touching(packing: Packing) -> None:
    """Refuse particles of which no two touch."""
    if contacts(packing).loose:
        raise InputError(
            f"no {packing.kind.particles} touch at phi = {packing.phi:.4g}, so nothing holds or resists: give a jammed "
            "packing, or shear it at a rate"
        )


REST = "give jamlab.relaxed(packing), or, to stop a flow, relax_stress(packing, strain=0, duration=...)"


LIMIT = 0.02  # imbalance from which on a quasi-static result is doubtful; that of a flow, from its tolerance on
LEAST_SHOWN = 1e-4
ROUNDING = 1e-13  # of an energy that is a sum over all contacts and edges
# background drag from which on finer steps help droplets: below, four flows that lost .013 to 113 of their work lost as
# much at a tenth of the tolerance, or found no step at all; with it 3e-5 to .006
HELD = 1e-2
FINER = 0.1  # tolerance to try next, over the present one; steps go as its root, errors as steps squared


def energy_gap(work: Array, lost: Array, energy: Array) -> Array:
    """(m,) work less what is lost and stored, since the first row: 0 but for errors of the steps, and 0 where it is no
    more than the sum of all energies rounds off. `work`: (m,) done since the start; `lost`: (m,) energy lost since the
    start; `energy`: (m,) elastic."""
    gap = work - lost - energy
    gap = gap - gap[0]
    return np.where(np.abs(gap) > ROUNDING * np.abs(energy).max(), gap, 0.0)


def energy_imbalance(gap: Array, work: Array, lost: Array) -> float:
    """Largest gap (m,) over the larger of work (m,) and loss (m,); 0 where nothing is done."""
    scale = max(float(np.abs(values - values[0]).max()) for values in (work, lost))
    return float(np.abs(gap).max()) / scale if scale > 0 else 0.0


def describe_balance(imbalance: float) -> str:
    """Say in words how well energy is balanced."""
    return f"energy balance to {_percent(imbalance)}"


def describe_unsettled(times: int) -> str:
    """Say how often contacts that open and close together had to be guessed; nothing if never."""
    return f", {times} contact changes unsettled" if times else ""


def warn_of_imbalance(imbalance: float, limit: float, remedy: Remedy, where: Sequence[str] = ()) -> str:
    """Say that a result is doubtful and what to do; nothing if energy is balanced. `imbalance`: largest one; `limit`:
    above which it is doubtful; `remedy`: what makes it smaller; `where`: names of the parts that are off, where there
    are several."""
    if not imbalance > limit:
        return ""
    place = f" at {', '.join(where)}" if where else ""
    return f"ENERGY BALANCE OFF by {_percent(imbalance)}{place}, above {100 * limit:g} %: {remedy}"


class Remedy(NamedTuple):
    """What to give to a flow next, so that its energy is better balanced; None: leave it as it is."""

    tolerance: float | None = None
    background: float | None = None
    step: float | None = None  # of strain, without time

    def __str__(self) -> str:
        if self.step is not None:
            return f"steps are too long to tell what events release; give step = {self.step:g}"
        if self.background is not None:
            return f"doubt the stresses; droplets snap against no drag: give background = {self.background:g}"
        return f"doubt the stresses; give tolerance = {self.tolerance:g}, or a lower rate"


def better_balance(packing: Packing, damping: Damping | None, background: float, tolerance: float) -> Remedy:
    """What balances the energy of a flow in time better: shorter steps, but for droplets that no drag holds back."""
    if packing.model == "dp" and damping is not None and damping.at_contacts and background < HELD:
        return Remedy(background=HELD)
    return Remedy(tolerance=FINER * tolerance)


def _percent(imbalance: float) -> str:
    return f"{100 * imbalance:.2g} %" if imbalance > LEAST_SHOWN else f"better than {100 * LEAST_SHOWN:g} %"


@dataclass(frozen=True, eq=False)
class FlowRun:
    """A flow in time: m rows, in the packing's unit of stress and with times in tau_1."""

    # time, strain: (m,) since the start
    time: Array
    strain: Array
    rate: Array  # (m,) of strain
    # (m,) shear stress, conjugate to the strain; at the start it is the residual stress of the packing and, at a given
    # rate, the viscous stress of the affine flow and the answer to it
    stress: Array
    # elastic_stress, viscous_stress: (m,) parts of it, by contact forces and by drag
    elastic_stress: Array
    viscous_stress: Array
    pressure: Array  # (m,) both parts of the forces, positive in compression
    normal_stress_difference: Array  # (m,) N_1 = sigma_xx - sigma_yy, tension positive
    dissipation: Array  # (m,) per time and area; in steady flow stress times rate
    energy: Array  # (m,) elastic, per area
    # work, dissipated: (m,) done and lost since the start, per area, over all steps
    work: Array
    dissipated: Array
    contacts: Array  # (m,) pairs of particles that press on each other
    # packings at the start, on the way if asked for, and at the end; strain and time in their provenance
    frames: tuple[Packing, ...] = field(repr=False)
    damping: Damping | None  # drag law; None without rate
    background: float  # drag of every disk against the affine flow beside it, over k tau_1
    tolerance: float  # relative error of velocities in a step
    # steps, iterations: of time, and of the solver over all of them
    steps: int
    iterations: int
    seconds: float  # wall time
    unit: str = field(repr=False)  # of stress, for labels
    # times that several disks which touch with no gap decided on each other, and no states of them fitted: the
    # closest were taken
    unsettled: int = field(default=0, kw_only=True)

    __repr__ = short_repr

    @property
    def packing(self) -> Packing:
        """The last state; no energy minimum: `converged` is False."""
        return self.frames[-1]

    @property
    def z_all(self) -> Array:
        """(m,) 2 N_c/N of all contacts that press, as `Contacts.z_all`; in motion no rule tells rattlers."""
        return np.asarray(2 * self.contacts / self.packing.n)

    @property
    def energy_gap(self) -> Array:
        """(m,) work less what is dissipated and stored, since the first row; 0 but for errors of the steps."""
        return energy_gap(self.work, self.dissipated, self.energy)

    @property
    def imbalance(self) -> float:
        """Largest part of the work that is neither stored nor lost: work less dissipated less change of energy."""
        return energy_imbalance(self.energy_gap, self.work, self.dissipated)

    @property
    def allowed_imbalance(self) -> float:
        """From which on the result is doubtful: the tolerance."""
        return self.tolerance

    @property
    def balanced(self) -> bool:
        """Whether energy is balanced as well as was asked for."""
        return self.imbalance <= self.allowed_imbalance

    @property
    def reached(self) -> str:
        """What the run has reached, in words; each kind of flow says it in its own."""
        raise NotImplementedError

    @property
    def conclusion(self) -> str:
        """What the run has reached, in words, and a warning if energy is not balanced to the tolerance."""
        warning = warn_of_imbalance(self.imbalance, self.allowed_imbalance, self.remedy)
        return "; ".join(filter(None, (self.reached, warning)))

    @property
    def remedy(self) -> Remedy:
        """What to give next where energy is not balanced."""
        return better_balance(self.packing, self.damping, self.background, self.tolerance)

    def describe(self) -> str:
        """Say with which drag and accuracy it was run, and how well energy is balanced."""
        how = describe_drag(self.damping, self.background, self.tolerance)
        return f"{how}, {describe_balance(self.imbalance)}{describe_unsettled(self.unsettled)}"


def describe_drag(damping: Damping | None, background: float, tolerance: float) -> str:
    """Say in words with which drag and accuracy a flow was run."""
    beside = f", background drag {background:g} k τ1" if background else ""
    return f"{damping}{beside}, tolerance {tolerance:g}"


def say_balance(axes: Any, imbalance: float, limit: float) -> None:
    """Title axes with how well energy is balanced; of several runs, with the worst that is doubtful."""
    doubtful = imbalance > limit
    if doubtful or not axes.get_title("right"):
        words = f"{describe_balance(imbalance)}: DOUBTFUL" if doubtful else describe_balance(imbalance)
        axes.set_title(words, fontsize=LEGEND, loc="right", color=RED if doubtful else BLACK)


def draw_in_time(axes: Any, time: Array, values: Array, name: str, **style: Any) -> None:
    """Draw values (m,) over time (m,), both logarithmic; the legend counts values that are not positive."""
    shown, left_out = positive(values)
    look = {"color": COLOURS[len(axes.lines) % len(COLOURS)], "linewidth": 1.6, "label": name + left_out}
    axes.loglog(time, shown, **merged_line(look, style))


def finish_in_time(axes: Any, y: str, run: FlowRun) -> None:
    """Name the axes of a response in time, and say how well energy is balanced."""
    label_axes(axes, r"time $t/\tau_1$", y)
    axes.legend(fontsize=LEGEND)
    say_balance(axes, run.imbalance, run.allowed_imbalance)
