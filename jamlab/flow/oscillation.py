"""Oscillating shear of any amplitude: harmonics of the stress, Lissajous figures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from jamlab.checks import check_choice
from jamlab.flow.flow_run import Array, FlowRun

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Complex = NDArray[np.complex128]

HARMONICS = 7  # of the stress: those beyond the fifth are below 1 % of the first even where it yields


@dataclass(frozen=True, eq=False, repr=False)
class Oscillation(FlowRun):
    """Strain amplitude sin(omega t) from rest; rows and packings as in `FlowRun`.

    >>> o = jamlab.oscillate(jamlab.pack(n=32, pressure=1e-2, seed=1), omega=1.0, amplitude=0.1, cycles=2)
    >>> bool(o.harmonics[0] == complex(o.storage, o.loss))
    True

    Stress in a cycle: residual + drift t + amplitude sum_k (G'_k sin k omega t + G''_k cos k omega t).

    Attributes:
        omega: angular frequency, 1/tau_1.
        amplitude: of the strain.
        points: rows in a cycle.
        cycle_harmonics: (cycles, k) complex G'_k + i G''_k of each cycle, k = 1, 2, ...
        converged: whether the first harmonic of the last two cycles differs by less than the tolerance.
    """

    omega: float
    amplitude: float
    points: int
    cycle_harmonics: Complex
    converged: bool

    @property
    def cycles(self) -> int:
        """Number of cycles."""
        return len(self.cycle_harmonics)

    @property
    def harmonics(self) -> Complex:
        """(k,) G'_k + i G''_k: of the last cycle, or, while cycles differ, the mean over their last half."""
        last = self.cycle_harmonics[-1:] if self.converged else self.cycle_harmonics[self.cycles // 2 :]
        return np.asarray(last.mean(axis=0))

    @property
    def storage(self) -> float:
        """G' of the first harmonic."""
        return float(self.harmonics[0].real)

    @property
    def loss(self) -> float:
        """G'' of the first harmonic: pi amplitude^2 G'' is lost in a cycle."""
        return float(self.harmonics[0].imag)

    @property
    def error(self) -> float:
        """Relative change of the first harmonic from the last cycle but one to the last; nan of one cycle."""
        if self.cycles < 2:
            return float("nan")
        before, last = self.cycle_harmonics[-2:, 0]
        return float(abs(last - before) / abs(last))

    @property
    def third_over_first(self) -> float:
        """|third harmonic| over |first|, the usual measure of non-linearity."""
        return float(abs(self.harmonics[2]) / abs(self.harmonics[0]))

    @property
    def reached(self) -> str:
        """What the run has reached, in words."""
        change = f"{self.error:.1g} from cycle to cycle after {self.cycles}"
        other = int(np.ptp(self.contacts))
        touching = f", {other} contacts open or close" if other else ""
        return f"{'periodic' if self.converged else 'NOT PERIODIC'}: G* changes by {change}{touching}"

    def __repr__(self) -> str:
        numbers = (
            f"omega={self.omega:g}, amplitude={self.amplitude:g}, storage={self.storage:.5g}, loss={self.loss:.5g}"
        )
        return f"Oscillation({numbers}, {self.describe()}; {self.verdict})"

    @property
    def last_cycle(self) -> slice:
        """Rows of the last cycle, both its ends included."""
        return slice(len(self.time) - 1 - self.points, len(self.time))

    def plot(self, ax: Any = None, *, against: str = "strain", **style: Any) -> Axes:
        """Draw the Lissajous figure: stress over strain, or over its rate, in the last cycle.

        >>> ax = jamlab.oscillate(jamlab.pack(n=32, pressure=1e-2, seed=1), omega=1.0, amplitude=0.1, cycles=2).plot()

        Args:
            ax: matplotlib Axes; by default those of a new figure.
            against: "strain" (the area is what is lost) or "rate".
            style: of matplotlib's Line2D.

        Returns:
            The axes.

        Raises:
            InputError: `ax` or `against` is something else, or matplotlib refuses the style.
        """
        from jamlab.flow.flow_plot import draw_lissajous
        from jamlab.plotting.axes import axes_for

        check_choice("against", against, ("strain", "rate"))
        with axes_for(ax, style) as axes:
            draw_lissajous(axes, self, against, **style)
        return axes


def fit_harmonics(time: Array, stress: Array, omega: float, amplitude: float) -> Complex:
    """(k,) harmonics of a stress (m,) over one cycle, a drift taken off: slow relaxation outlasts any run."""
    orders = np.arange(1, HARMONICS + 1)
    phase = omega * time[:, None] * orders
    columns = np.column_stack([np.sin(phase), np.cos(phase), np.ones_like(time), time - time[0]])
    found = np.linalg.lstsq(columns, stress, rcond=None)[0] / amplitude
    return np.asarray(found[:HARMONICS] + 1j * found[HARMONICS : 2 * HARMONICS])
