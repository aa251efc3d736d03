"""A flow curve: stress of steady flow over the rate of shear."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.flow.energy_balance import LIMIT, describe_balance, finer_steps, warn_of_imbalance
from jamlab.flow.flow_run import describe_drag
from jamlab.packing.packing import Packing
from jamlab.rheology.damping import Damping
from jamlab.statistics.herschel_bulkley import HerschelBulkley, herschel_bulkley

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class FlowCurve:
    """Steady states at m rates, in the packing's unit of stress and with times in tau_1; errors are standard errors.

    >>> c = jamlab.flow_curve(jamlab.pack(n=32, pressure=1e-2, seed=1), rates=[1.0], strain=1.0, discard=0.2)
    >>> bool(c.stress[0] > c.stress_error[0] > 0)
    True

    Attributes:
        rates: (m,) of shear, ascending.
        stress, stress_error: (m,) mean shear stress.
        elastic_stress, pressure, normal_stress_difference: (m,) means, each with `..._error`.
        dissipation: (m,) mean, per time and area, over all steps; stress times rate but for what elastic energy took.
        drift: (m,) change of the stress from the first to the second half of the average, in its standard errors.
        plastic_events: (m,) seen per unit of strain.
        imbalance: (m,) part of the work of the average that is neither stored nor lost.
        seconds: (m,) wall time.
        discard, strain: of start-up, left out, and of the average.
        frames: the packing at the start and the last state of each rate.
        damping, background, tolerance, unit: see `FlowRun`.
    """

    rates: Array
    stress: Array
    stress_error: Array
    elastic_stress: Array
    elastic_stress_error: Array
    pressure: Array
    pressure_error: Array
    normal_stress_difference: Array
    normal_stress_difference_error: Array
    dissipation: Array
    drift: Array
    plastic_events: Array
    imbalance: Array
    seconds: Array
    discard: float
    strain: float
    frames: tuple[Packing, ...] = field(repr=False)
    damping: Damping
    background: float
    tolerance: float
    unit: str = field(repr=False)

    @property
    def steady(self) -> NDArray[np.bool_]:
        """(m,) whether the stress has the same mean in both halves of the average, as far as errors tell."""
        from jamlab.statistics.block_average import LARGEST_DRIFT

        return np.abs(self.drift) <= LARGEST_DRIFT

    @property
    def packings(self) -> tuple[Packing, ...]:
        """The last state of each rate."""
        return self.frames[1:]

    @property
    def verdict(self) -> str:
        """What the curve has reached, in words, and a warning if energy is not balanced to 2 %."""
        drifting = ", ".join(f"{rate:g}" for rate in self.rates[~self.steady])
        reached = f"NOT STEADY at rate {drifting}" if drifting else "steady at every rate"
        off = [f"rate {rate:g}" for rate in self.rates[self.imbalance > LIMIT]]
        return "; ".join(filter(None, (reached, warn_of_imbalance(self._worst, finer_steps(self.tolerance), off))))

    @property
    def _worst(self) -> float:
        return float(self.imbalance.max(initial=0.0))

    def describe(self) -> str:
        """Say with which drag and accuracy it was run, and how well energy is balanced at the worst rate."""
        how = describe_drag(self.damping, self.background, self.tolerance)
        return f"{how}, {describe_balance(self._worst)}"

    def __repr__(self) -> str:
        points = ", ".join(
            f"{rate:g}: {stress:.4g} ± {error:.1g}"
            for rate, stress, error in zip(self.rates, self.stress, self.stress_error, strict=True)
        )
        return f"FlowCurve({points}, {self.damping}, {describe_balance(self._worst)}; {self.verdict})"

    @checked
    def herschel_bulkley(self, *, lowest: float = 0.0, highest: float = np.inf) -> HerschelBulkley:
        """Fit yield stress, consistency and exponent.

        The law holds up to about 1e-2 over tau_1; beyond, contacts themselves limit the flow.

        Args:
            lowest, highest: window in the rates.

        Raises:
            InputError: fewer than three rates in the window.
            ConvergenceError: no fit is found.
        """
        kept = (self.rates >= lowest) & (self.rates <= highest)
        if kept.sum() < 3:
            raise InputError(
                f"{kept.sum()} rates between {lowest:g} and {highest:g}: three are needed for three unknowns"
            )
        return herschel_bulkley(self.rates[kept], self.stress[kept], self.stress_error[kept], self.unit)

    def plot(self, ax: Any = None, **style: Any) -> Axes:
        """Draw the stress over the rate with its errors; open symbols are not steady.

        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> ax = jamlab.flow_curve(p, rates=[0.3, 1.0], strain=1.0, discard=0.2).plot()

        Args:
            ax: matplotlib Axes; by default those of a new figure.
            style: of matplotlib's Line2D; `label` names the curve in the legend.

        Returns:
            The axes.

        Raises:
            InputError: `ax` is something else, or matplotlib refuses the style.
        """
        from jamlab.flow.flow_plot import draw_flow_curve
        from jamlab.plotting.axes import axes_for

        with axes_for(ax, style) as axes:
            draw_flow_curve(axes, self, **style)
        return axes
