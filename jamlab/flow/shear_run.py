"""Start-up of shear at a constant rate: overshoot, steady state, and plastic events where the elastic stress falls."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.flow.flow_run import FlowRun
from jamlab.flow.report import say_balance
from jamlab.flow.velocity_profile import VelocityProfile, velocity_profile
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, merged_line
from jamlab.plotting.palette import COLOURS
from jamlab.statistics.confidence import FEWEST_BLOCKS, BlockAverage, block_average


class StressDrops(NamedTuple):
    """Falls of the stress, one after the other: the `strain` (k,) where each begins, and its `size` (k,), positive."""

    strain: Array
    size: Array


def stress_drops(strain: Array, stress: Array, least: float = 0.0) -> StressDrops:
    """Find the falls of a stress (m,) over strain (m,), each from a local maximum to the next minimum.

    Args:
        strain: (m,), growing.
        stress: (m,).
        least: smallest fall that counts.
    """
    falling = np.concatenate([[False], np.diff(stress) < 0, [False]])
    edges = np.flatnonzero(np.diff(falling.astype(int)))  # of the steps, where falling begins and where it ends
    begin, end = edges[::2], edges[1::2]
    size = stress[begin] - stress[end]
    kept = size > least
    return StressDrops(strain[begin[kept]], size[kept])


LEAST_DROP = 0.01  # of the range of elastic stresses in a run: smaller falls are no plastic events
TRANSIENT = 1.0  # strain at which start-up is over: the overshoot lies at 0.1 to 0.4
_OVER = 0.02  # by which a peak must exceed the last stress, to be one


class Peak(NamedTuple):
    """Largest shear stress of a start-up, and where it is."""

    strain: float
    stress: float


@dataclass(frozen=True, eq=False, repr=False)
class ShearRun(FlowRun):
    """Shear at a constant rate; rows and packings as in `FlowRun`.

    >>> r = jamlab.shear(jamlab.pack(n=32, pressure=1e-2, seed=1), rate=1.0, strain=0.05, n_rows=5)
    >>> bool(np.allclose(r.stress, r.elastic_stress + r.viscous_stress))
    True

    Attributes:
        shear_rate: rate that was asked for, 1/tau_1; 0: see `QuasistaticShear`; of several parts the last one.
        strain_asked: strain to be sheared by, of all parts; less is reached by a run that was interrupted.
        parts: (p, 2) rate and strain of each part of a protocol; None: one rate all the way.
    """

    shear_rate: float
    strain_asked: float
    parts: Array | None = field(default=None, kw_only=True)

    @property
    def velocity_profile(self) -> VelocityProfile:
        """Mean velocity at each height, between the packings that were kept."""
        return velocity_profile(self.frames)

    @property
    def path(self) -> Array:
        """(m,) strain so far, to and fro counted alike."""
        return np.concatenate([[0.0], np.cumsum(np.abs(np.diff(self.strain)))])

    @property
    def _last_part(self) -> float:
        """Path at which the last part begins."""
        return 0.0 if self.parts is None else float(self.parts[:-1, 1].sum())

    @property
    def peak(self) -> Peak | None:
        """Overshoot: largest stress up to strain 1, if it falls by 2 % or more from there; else None.

        For shear in the negative direction the lowest stress; for several parts the peak of the first.
        """
        first = (self.shear_rate or self.strain[-1]) if self.parts is None else self.parts[0, 0]
        path = self.path
        rows = slice(None) if self.parts is None else path <= self.parts[0, 1] * (1 + 1e-9)
        stress, strain = (-1.0 if first < 0 else 1.0) * self.stress[rows], self.strain[rows]
        k = int(np.argmax(stress[path[rows] <= TRANSIENT]))
        if k == 0 or k == len(stress) - 1 or stress[k] < (1 + _OVER) * stress[k + 1 :].min():
            return None
        return Peak(float(strain[k]), float(self.stress[k]))

    @property
    def drops(self) -> StressDrops:
        """Falls of the elastic stress along the flow, by more than 1 % of its range."""
        along = np.cumsum(np.sign(np.diff(self.strain)) * np.diff(self.elastic_stress))
        return stress_drops(self.strain, np.append(0.0, along), LEAST_DROP * float(np.ptp(self.elastic_stress)))

    @property
    def plastic_events(self) -> int:
        """Number of drops. At a finite rate events overlap and small ones are hidden: it counts what is seen."""
        return len(self.drops.size)

    @checked
    def steady(self, name: str = "stress", *, discard: float = TRANSIENT) -> BlockAverage:
        """Average a quantity over the steady flow, with its error from blocks.

        The shear stress is the work done between rows over the strain, so that nothing between them is missed.

        Args:
            name: of an array of this run, such as "pressure".
            discard: strain of start-up that is left out; for several parts, of the last one, which is averaged.

        Raises:
            InputError: fewer than sixteen rows lie beyond `discard`, or no such array.
        """
        kept = self.path >= (self._last_part + discard) * (1 - 1e-9)
        if kept.sum() <= 2 * FEWEST_BLOCKS:
            raise InputError(
                f"only {kept.sum()} rows lie beyond strain {discard:g}, but {2 * FEWEST_BLOCKS + 1} are "
                f"needed: shear to more than {self.path[-1]:g}, or use a larger n_rows"
            )
        values = getattr(self, name, None)
        if not isinstance(values, np.ndarray) or len(values) != len(self.strain):
            raise InputError(f"name = {name!r}: a ShearRun has no array of this name; an example is 'stress'")
        if name == "stress" and self.shear_rate:
            return block_average(np.diff(self.work[kept]) / np.diff(self.strain[kept]))
        return block_average(values[kept][1:])

    @property
    def state(self) -> Literal["interrupted", "start-up", "steady", "drifting"]:
        """Whether the strain asked for is reached, strain 1 with enough rows for a mean, and whether the stress has one
        mean in both halves beyond."""
        if not self.finished:
            return "interrupted"
        mean = self._mean
        return "start-up" if mean is None else "steady" if mean.steady else "drifting"

    @property
    def _mean(self) -> BlockAverage | None:
        """Of the stress beyond strain 1; None if it is not reached, or in too few rows."""
        try:
            return self.steady()
        except InputError:
            return None

    @property
    def summary(self) -> dict[str, Any]:
        """Last strain, overshoot, and mean stress of steady flow with its standard error, of those that there are."""
        peak, mean = self.peak, self._mean
        found: dict[str, Any] = {"rate": self.parts[:, 0]} if self.parts is not None else {}
        found |= {"rate": self.shear_rate} if self.shear_rate and not found else {}
        found["strain"] = float(self.path[-1])
        found |= {"peak stress": peak.stress, "at strain": peak.strain} if peak else {}
        return found | ({"stress": (mean.value, mean.error)} if mean else {})

    @property
    def finished(self) -> bool:
        """Whether the strain asked for is reached."""
        return bool(self.path[-1] >= self.strain_asked * (1 - 1e-9))

    @drawn("Line2D, of both curves; `label` names them in the legend")
    def plot(self, axes: Any, /, label: str = "", **style: Any) -> None:
        """Draw the shear stress (solid) and its elastic part (dashed) over strain.

        >>> ax = jamlab.shear(jamlab.pack(n=32, pressure=1e-2, seed=1), rate=1.0, strain=0.1, n_rows=10).plot()
        """
        colour = COLOURS[len(axes.lines) // 2 % len(COLOURS)]
        name = label or (f"rate {self.shear_rate:g}/$\\tau_1$" if self.shear_rate else "quasi-static")
        parts = ((self.stress, name, "-", 1.6), (self.elastic_stress, "elastic part", "--", 1.2))
        for stress, text, line, width in parts:
            look = {"color": colour, "linestyle": line, "linewidth": width, "label": text}
            axes.plot(self.strain, stress, **merged_line(look, style))
        label_axes(axes, r"strain $\gamma$", in_unit(r"shear stress $\sigma$", self.unit))
        axes.legend(fontsize=LEGEND)
        say_balance(axes, self)
