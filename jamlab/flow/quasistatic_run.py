"""Quasi-static shear of a packing: minima along the strain, plastic events between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from jamlab.flow.energy_balance import describe_balance, energy_gap
from jamlab.flow.shear_run import ShearRun
from jamlab.flow.stress_drops import StressDrops
from jamlab.packing.short_repr import short_repr
from jamlab.plotting.axes import axes_for

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PlasticEvents:
    """Steps in which stress fell, m of them, and from which a step back does not lead back.

    Attributes:
        strain: (m,) at the end of the step.
        stress_drop: (m,) stress before less that after.
        released: (m,) energy lost per area: the work by the trapezoidal rule less the rise of the energy.
        width: (m,) strain of the step: the event lies that much before `strain` at most.
    """

    strain: Array
    stress_drop: Array
    released: Array
    width: Array

    __repr__ = short_repr

    def __len__(self) -> int:
        return len(self.strain)


@dataclass(frozen=True, eq=False, repr=False)
class QuasistaticShear(ShearRun):
    """States of `quasistatic_shear`, m of them with the start; rows and packings as in `FlowRun`, without drag.

    There is no time: `time`, `rate`, `viscous_stress` and `dissipation` are 0. `work` is the integral of the stress,
    `dissipated` what of it is not stored: what events release, and the error of the trapezoidal rule.

    Attributes:
        converged: (m,) bool, whether the minimisation met its tolerance.
        max_force: (m,) largest force left.
        event_strain, event_drop, event_released, event_width: (k,) see `PlasticEvents`.
    """

    converged: NDArray[np.bool_]
    max_force: Array
    event_strain: Array
    event_drop: Array
    event_released: Array
    event_width: Array

    @property
    def events(self) -> PlasticEvents:
        """Plastic events."""
        return PlasticEvents(self.event_strain, self.event_drop, self.event_released, self.event_width)

    @property
    def drops(self) -> StressDrops:
        """Stress drops of the events, at the strain where each begins."""
        return StressDrops(self.event_strain - self.event_width, self.event_drop)

    @property
    def reached(self) -> str:
        """What the run has reached, in words."""
        missed = int((~self.converged).sum())
        return super().reached + (f"; {missed} of {len(self.converged)} states NOT CONVERGED" if missed else "")

    @property
    def energy_gap(self) -> Array:
        """(m,) work that is neither stored nor released by an event that was seen: error of steps that are too long."""
        released = np.zeros(len(self.strain))
        released[self.strain.searchsorted(self.event_strain)] = self.event_released
        return energy_gap(self.work, np.cumsum(released), self.energy)

    def _remedy(self) -> str:
        return "steps are too long to tell what events release; give half the step"

    def describe(self) -> str:
        """Say how it was run, and how well energy is balanced."""
        return f"quasi-static, largest force {self.tolerance:g}, {describe_balance(self.imbalance)}"

    def __repr__(self) -> str:
        return f"QuasistaticShear(strain={self.strain[-1]:.4g}, {self.describe()}; {self.verdict})"

    def plot(self, ax: Any = None, **style: Any) -> Axes:
        """Draw stress over strain; plastic events are the steep falls, with a mark where the stress ends up.

        >>> ax = jamlab.shear(jamlab.pack(n=32, pressure=1e-2, seed=1), rate=0, strain=0.01, step=2e-3).plot()

        Args:
            ax: matplotlib Axes; by default those of a new figure.
            style: of matplotlib's Line2D, such as color="k".

        Returns:
            The axes.

        Raises:
            InputError: `ax` is something else, or matplotlib refuses the style.
        """
        from jamlab.flow.quasistatic_shear_plot import draw_shear

        with axes_for(ax, style) as axes:
            draw_shear(axes, self, **style)
        return axes
