"""Creep under a constant stress: compliance, and whether it comes to rest or flows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from jamlab.flow.flow_run import Array, FlowRun

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_RESTS, _FLOWS = 0.02, 0.9  # d ln strain/d ln time over the last half of the time, below and above
_LEFT = 0.02  # of the stress applied that drag may bear at rest
_YIELDED = 0.2  # strain below which a packing has not yielded, however fast it creeps


@dataclass(frozen=True, eq=False, repr=False)
class CreepRun(FlowRun):
    """Strain in time under a stress; rows and packings as in `FlowRun`.

    >>> k = jamlab.creep(jamlab.pack(n=32, pressure=1e-2, seed=1), stress=1e-7, duration=10.0)
    >>> len(k.time) == len(k.strain) == len(k.compliance)
    True

    Attributes:
        applied: stress beside the residual one.
        residual: shear stress of the packing at rest, before.
        duration: time that was asked for.
    """

    applied: float
    residual: float
    duration: float

    @property
    def compliance(self) -> Array:
        """(m,) J(t) = strain over the stress applied."""
        return np.asarray(self.strain / self.applied)

    @property
    def final_rate(self) -> float:
        """Mean rate of strain over the last half of the time."""
        middle = self._middle
        return float((self.strain[-1] - self.strain[middle]) / (self.time[-1] - self.time[middle]))

    @property
    def slope(self) -> float:
        """d ln strain/d ln time over the last half of the time: 0 at rest, 1 in steady flow."""
        a, b = self.strain[self._middle], self.strain[-1]
        return float(np.log(b / a) / np.log(self.time[-1] / self.time[self._middle])) if a > 0 and b > 0 else 0.0

    @property
    def _middle(self) -> int:
        return int(np.searchsorted(self.time, 0.5 * self.time[-1]) - 1) or 1

    @property
    def reached(self) -> str:
        """What the run has reached, in words."""
        early = "" if self.time[-1] >= self.duration * (1 - 1e-9) else f"ended at time {self.time[-1]:.3g}: "
        if self.slope < _RESTS and abs(self.viscous_stress[-1]) < _LEFT * abs(self.applied):
            return f"{early}at rest at strain {self.strain[-1]:.4g}"
        if self.slope > _FLOWS and self.strain[-1] > _YIELDED:
            return f"{early}flows at rate {self.final_rate:.3g}"
        return f"{early}STILL CREEPS: strain {self.strain[-1]:.3g} grows as time^{self.slope:.2f}"

    def __repr__(self) -> str:
        return f"CreepRun(stress={self.applied:g}, {self.describe()}; {self.verdict})"

    def plot(self, ax: Any = None, **style: Any) -> Axes:
        """Draw the compliance over time, on logarithmic axes.

        >>> ax = jamlab.creep(jamlab.pack(n=32, pressure=1e-2, seed=1), stress=1e-7, duration=10.0).plot()

        Args:
            ax: matplotlib Axes; by default those of a new figure.
            style: of matplotlib's Line2D.

        Returns:
            The axes.

        Raises:
            InputError: `ax` is something else, or matplotlib refuses the style.
        """
        from jamlab.flow.flow_plot import draw_creep
        from jamlab.plotting.axes import axes_for

        with axes_for(ax, style) as axes:
            draw_creep(axes, self, **style)
        return axes
