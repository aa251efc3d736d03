"""What every flow in time leaves: its rows, the packings on the way, and with which drag and accuracy it was run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from jamlab.flow.energy_balance import describe_balance, energy_gap, energy_imbalance, finer_steps, warn_of_imbalance
from jamlab.packing.packing import Packing
from jamlab.packing.short_repr import short_repr
from jamlab.rheology.damping import Damping

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]  # what is done, and the share of all work that is done by then


@dataclass(frozen=True, eq=False)
class FlowRun:
    """A flow in time: m rows, in the packing's unit of stress and with times in tau_1.

    Attributes:
        time, strain: (m,) since the start.
        rate: (m,) of strain.
        stress: (m,) shear stress, conjugate to the strain; at the start it is the residual stress of the packing and,
            at a given rate, the viscous stress of the affine flow and the answer to it.
        elastic_stress, viscous_stress: (m,) parts of it, by contact forces and by drag.
        pressure: (m,) both parts of the forces, positive in compression.
        normal_stress_difference: (m,) N_1 = sigma_xx - sigma_yy, tension positive.
        dissipation: (m,) per time and area; in steady flow stress times rate.
        energy: (m,) elastic, per area.
        work, dissipated: (m,) done and lost since the start, per area, over all steps.
        contacts: (m,) pairs that touch; of droplets, except at rate 0, vertices that touch an edge.
        frames: packings at the start, on the way if asked for, and at the end; strain and time in their provenance.
        damping: drag law; None without rate.
        background: drag of every disk against the affine flow beside it, over k tau_1.
        tolerance: relative error of velocities in a step.
        steps, iterations: of time, and of the solver over all of them.
        seconds: wall time.
        unit: of stress, for labels.
    """

    time: Array
    strain: Array
    rate: Array
    stress: Array
    elastic_stress: Array
    viscous_stress: Array
    pressure: Array
    normal_stress_difference: Array
    dissipation: Array
    energy: Array
    work: Array
    dissipated: Array
    contacts: Array
    frames: tuple[Packing, ...] = field(repr=False)
    damping: Damping | None
    background: float
    tolerance: float
    steps: int
    iterations: int
    seconds: float
    unit: str = field(repr=False)

    __repr__ = short_repr

    @property
    def packing(self) -> Packing:
        """The last state; no energy minimum: `converged` is False."""
        return self.frames[-1]

    @property
    def energy_gap(self) -> Array:
        """(m,) work less what is dissipated and stored, since the first row; 0 but for errors of the steps."""
        return energy_gap(self.work, self.dissipated, self.energy)

    @property
    def imbalance(self) -> float:
        """Largest part of the work that is neither stored nor lost: work less dissipated less change of energy."""
        return energy_imbalance(self.energy_gap, self.work, self.dissipated)

    @property
    def reached(self) -> str:
        """What the run has reached, in words; each kind of flow says it in its own."""
        raise NotImplementedError

    @property
    def verdict(self) -> str:
        """What the run has reached, in words, and a warning if energy is not balanced to 2 %."""
        return "; ".join(filter(None, (self.reached, warn_of_imbalance(self.imbalance, self._remedy()))))

    def _remedy(self) -> str:
        return finer_steps(self.tolerance)

    def describe(self) -> str:
        """Say with which drag and accuracy it was run, and how well energy is balanced."""
        how = describe_drag(self.damping, self.background, self.tolerance)
        return f"{how}, {describe_balance(self.imbalance)}"


def describe_drag(damping: Damping | None, background: float, tolerance: float) -> str:
    """Say in words with which drag and accuracy a flow was run."""
    beside = f", background drag {background:g} k τ1" if background else ""
    return f"{damping}{beside}, tolerance {tolerance:g}"
