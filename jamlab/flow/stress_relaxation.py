"""Relaxation of the stress after a step of strain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from jamlab.flow.flow_run import Array, FlowRun

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_RESTS = 1e-3  # relative fall of the modulus over the last half of the time


@dataclass(frozen=True, eq=False, repr=False)
class StressRelaxation(FlowRun):
    """Stress in time after a step of strain; rows and packings as in `FlowRun`, times from the middle of the step.

    >>> g = jamlab.relax_stress(jamlab.pack(n=32, pressure=1e-2, seed=1), strain=1e-6, duration=10.0)
    >>> len(g.time) == len(g.modulus), g.step_strain
    (True, 1e-06)

    Attributes:
        step_strain: of the step.
        step_time: that the step took; the modulus at a time t knows of it by (step_time/t)^2/24 only.
        residual: shear stress of the packing at rest, before.
        duration: time that was asked for.
    """

    step_strain: float
    step_time: float
    residual: float
    duration: float

    @property
    def modulus(self) -> Array:
        """(m,) G(t) = (stress - residual)/strain."""
        return np.asarray((self.stress - self.residual) / self.step_strain)

    @property
    def reached(self) -> str:
        """What the run has reached, in words."""
        g = self.modulus
        change = abs(float(np.interp(0.5 * self.time[-1], self.time, g)) - g[-1]) / abs(g[-1])
        if change < _RESTS:
            return f"relaxed to G = {g[-1]:.4g}"
        return f"NOT RELAXED: G = {g[-1]:.4g} has changed by {change:.1g} over the last half of the time"

    def __repr__(self) -> str:
        return f"StressRelaxation(strain={self.step_strain:g}, {self.describe()}; {self.verdict})"

    def plot(self, ax: Any = None, **style: Any) -> Axes:
        """Draw the modulus over time, on logarithmic axes.

        >>> ax = jamlab.relax_stress(jamlab.pack(n=32, pressure=1e-2, seed=1), strain=1e-6, duration=10.0).plot()

        Args:
            ax: matplotlib Axes; by default those of a new figure.
            style: of matplotlib's Line2D.

        Returns:
            The axes.

        Raises:
            InputError: `ax` is something else, or matplotlib refuses the style.
        """
        from jamlab.flow.flow_plot import draw_relaxation
        from jamlab.plotting.axes import axes_for

        with axes_for(ax, style) as axes:
            draw_relaxation(axes, self, **style)
        return axes
