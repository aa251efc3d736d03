"""Oscillating shear of any amplitude: harmonics and Lissajous figures; it runs until cycles repeat."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Literal, get_args

import numpy as np

from jamlab.arguments.choices import Against
from jamlab.arrays import Array, Complex
from jamlab.checks import check_choice, checked
from jamlab.flow.flow_run import FlowRun
from jamlab.flow.overdamped_session import (
    SMALL_STRAIN_BACKGROUND,
    SMALL_STRAIN_TOLERANCE,
    End,
    check_flow_tolerance,
)
from jamlab.flow.report import say_balance
from jamlab.flow.run import TimedRun
from jamlab.packing.packing import Packing
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, merged_line
from jamlab.plotting.palette import COLOURS
from jamlab.processes.progress import Progress
from jamlab.rheology.drag_law import DragLaw

HARMONICS = 7  # of the stress: those beyond the fifth are below 1 % of the first even where it yields


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Oscillation(FlowRun):
    """Strain amplitude sin(omega t) from rest; rows and packings as in `FlowRun`.

    Stress in a cycle: residual + drift t + amplitude sum_k (G'_k sin k omega t + G''_k cos k omega t).

    Attributes:
        omega: angular frequency, 1/tau_1.
        amplitude: strain amplitude.
        points_per_cycle: rows of a cycle.
        cycle_harmonics: (cycles, k) complex G'_k + i G''_k of each cycle, k = 1, 2, ...
        finished: whether it repeats: the first harmonic of the last two cycles differs by less than the tolerance.
    """

    numbers: ClassVar[tuple[str, ...]] = (*FlowRun.numbers, "cycles", "storage", "loss", "third_over_first", "change")

    omega: float
    amplitude: float
    points_per_cycle: int
    cycle_harmonics: Complex
    finished: bool

    @property
    def cycles(self) -> int:
        """Number of cycles."""
        return len(self.cycle_harmonics)

    @property
    def harmonics(self) -> Complex:
        """(k,) G'_k + i G''_k: of the last cycle, or, while cycles differ, the mean over their last half."""
        last = self.cycle_harmonics[-1:] if self.finished else self.cycle_harmonics[self.cycles // 2 :]
        return np.asarray(last.mean(axis=0))

    @property
    def storage(self) -> float:
        """G' of the first harmonic."""
        return float(self.harmonics[0].real)

    @property
    def loss(self) -> float:
        """G'' of the first harmonic: pi amplitude^2 G'' is the work of a cycle, all steps counted."""
        return float(self.harmonics[0].imag)

    @property
    def change(self) -> float:
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
    def state(self) -> Literal["periodic", "not periodic"]:
        """Whether the stress repeats."""
        return "periodic" if self.finished else "not periodic"

    @property
    def summary(self) -> dict[str, float]:
        """Frequency, amplitude, first harmonic, its change over the last of so many cycles, contacts that change."""
        first = {"omega": self.omega, "amplitude": self.amplitude, "storage": self.storage, "loss": self.loss}
        change = {"change": self.change, "cycles": self.cycles, "changing contacts": float(np.ptp(self.contacts))}
        return first | change

    @drawn("Line2D", raises="`against` is neither strain nor rate, ")
    def plot(self, axes: Any, /, *, against: Against = "strain", label: str = "", **style: Any) -> None:
        """Draw the Lissajous figure: stress less its mean over strain, or over its rate, in the last cycle.

        `against` is "strain" (the area is what is lost) or "rate".
        """
        check_choice("against", against, get_args(Against))
        rows = slice(len(self.time) - 1 - self.points_per_cycle, None)  # of the last cycle, both its ends included
        x = self.strain[rows] if against == "strain" else self.rate[rows]
        stress = self.stress[rows]
        name = label or rf"$\gamma_0$ = {self.amplitude:g}, $\omega\,\tau_1$ = {self.omega:g}"
        name += "" if self.finished else ", not periodic"
        look = {"color": COLOURS[len(axes.lines) % len(COLOURS)], "linewidth": 1.6, "label": name}
        axes.plot(x, stress - stress[1:].mean(), **merged_line(look, style))
        across = r"strain $\gamma$" if against == "strain" else r"rate of strain $\dot\gamma\,\tau_1$"
        axes.locator_params(axis="x", nbins=5)
        label_axes(axes, across, in_unit(r"shear stress $\sigma$, less its mean", self.unit))
        axes.legend(fontsize=LEGEND)
        say_balance(axes, self)


def fit_harmonics(time: Array, stress: Array, omega: float, amplitude: float) -> Complex:
    """(k,) harmonics of a stress (m,) over one cycle, a drift taken off: slow relaxation outlasts any run."""
    orders = np.arange(1, HARMONICS + 1)
    phase = omega * time[:, None] * orders
    columns = np.column_stack([np.sin(phase), np.cos(phase), np.ones_like(time), time - time[0]])
    found = np.linalg.lstsq(columns, stress, rcond=None)[0] / amplitude
    return np.asarray(found[:HARMONICS] + 1j * found[HARMONICS : 2 * HARMONICS])


OSCILLATION_DEFINITION = 3  # version, see jamlab.campaign.tasks; 2 differs by rounding


@checked
def oscillate(
    packing: Packing,
    omega: float,
    amplitude: float,
    damping: DragLaw | None = None,
    *,
    cycles: int = 20,
    points_per_cycle: int = 32,  # about as many as there are steps at high frequencies
    tolerance: float = SMALL_STRAIN_TOLERANCE,
    background_drag: float = SMALL_STRAIN_BACKGROUND,
    trajectory_error: bool = False,
    path: str | Path | None = None,
    progress: Progress | None = None,
) -> Oscillation:
    """Shear a packing by amplitude sin(omega t) along x (overdamped) until the stress is periodic.

    At small amplitude, storage and loss equal `complex_modulus` if no contact opens or closes. Near onset this requires
    amplitudes well below pressure/stiffness. Rattlers that touch contribute to the drag here, but not in
    `complex_modulus`.

    >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
    >>> o, s = jamlab.oscillate(p, omega=1.0, amplitude=1e-6), jamlab.complex_modulus(p, [1.0])
    >>> bool(abs(o.storage - s.storage[0]) < 2e-3 * s.storage[0])
    True

    Args:
        packing: SP or DP at a minimum.
        omega: angular frequency, 1/tau_1, from 1e-8 to 1e3.
        amplitude: of the strain, up to 2.
        damping: see `shear`.
        cycles: largest number of cycles, at least 2. The run ends when the first harmonic changes by less than the
            tolerance.
        points_per_cycle: rows of a cycle, at least 16.
        tolerance: relative error of velocities per step, 1e-9 to 0.1, default 1e-3. It does not bound the error of
            stresses where contacts change, see `shear`.
        background_drag: Stokes drag in addition to contact damping, in units of k tau_1. Default: 0, as in
            `complex_modulus`. Use 1e-2 for droplets whose contacts change; see `shear`.
        trajectory_error: True: repeat the run at a tenth of the tolerance and return the difference, see `shear`.
        path, progress: see `shear`.

    Raises:
        InputError: no particles touch, or a value is out of range.
        ConvergenceError: the packing is not at rest, or see `shear`.
        StorageError: see `shear`.
    """
    check_flow_tolerance(tolerance, trajectory_error)
    shorter = f"a higher omega than {omega:g}; complex_modulus gives the answer to a small amplitude"
    how = {"omega": omega, "amplitude": amplitude, "points_per_cycle": points_per_cycle}
    period = 2 * np.pi / omega
    accuracy, end = (tolerance, background_drag), End(2 * period, shorter)
    with TimedRun(Oscillation, packing, damping, accuracy, how, end, path, progress, at_rest=True) as flow:
        found = list(flow.before.cycle_harmonics) if flow.before else []
        flow.warn_beyond("cycles", len(found), cycles)
        flow.facts |= how | _answer(found, tolerance)
        flow.drive(f"oscillate {amplitude:.17g} {omega:.17g}", period / points_per_cycle)
        while len(found) < cycles and not flow.facts["finished"]:
            flow.session.end = end._replace(time=max(2, len(found) + 1) * period)  # one cycle tells nothing
            rows = [flow.advance() for _ in range(points_per_cycle)]
            time, stress = (np.array([getattr(row, name) for row in rows]) for name in ("time", "stress"))
            harmonics = fit_harmonics(time, stress, omega, amplitude)
            work = rows[-1].work - flow.rows[-1 - points_per_cycle].work
            harmonics[0] = complex(harmonics[0].real, work / (np.pi * amplitude**2))
            found.append(harmonics)
            flow.facts |= _answer(found, tolerance)
            flow.report(len(found) / cycles, f"cycle {len(found)}")
        if trajectory_error:
            same: dict[str, Any] = {
                "cycles": cycles,
                "points_per_cycle": points_per_cycle,
                "background_drag": background_drag,
            }
            flow.measure_trajectory_error(
                lambda finer, told: oscillate(
                    packing, omega, amplitude, damping, tolerance=finer, progress=told, **same
                )
            )
        return flow.finish()


def _answer(found: list[Complex], tolerance: float) -> dict[str, Any]:
    repeats = len(found) > 1 and bool(abs(found[-1][0] - found[-2][0]) <= tolerance * abs(found[-1][0]))
    return {"cycle_harmonics": np.array(found), "finished": repeats}
