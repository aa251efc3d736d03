"""The mode that softens before a plastic event: its direction, and how its eigenvalue vanishes.

A minimum that meets a saddle ends there: along the mode that joins both, the lowest eigenvalue of the Hessian goes to
zero as the square root of the distance in strain, lambda = a sqrt(gamma_c - gamma) (Malandro & Lacks, J. Chem. Phys.
110, 4593 (1999); Maloney & Lemaitre, Phys. Rev. E 74, 016118 (2006), eq 24). So the strain is a power series of lambda
without a linear term,

    gamma = gamma_c - lambda^2/a^2 + c_3 lambda^3 + c_4 lambda^4,

which is fitted. Harmonic disks have another end: a contact that opens takes its stiffness away at once, and the
Hessian jumps from a finite eigenvalue to a negative one. Such an event does not fit.

At constant pressure the area is a coordinate beside the sites, and the eigenvalues belong to the Hessian of the
enthalpy.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import checked
from jamlab.errors import InputError, named
from jamlab.flow.plastic_events import bearing_contacts
from jamlab.flow.quasistatic_run import QuasistaticShear
from jamlab.flow.quasistatic_walk import Shearing, Walk
from jamlab.mechanics.enthalpy_modes import lowest_of_enthalpy
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.packing.shear_direction import ShearDirection, shear_direction
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, merged_line
from jamlab.plotting.palette import BLACK, BLUE
from jamlab.statistics.power_laws import fit_power_law


@dataclass(frozen=True)
class SofteningFit:
    """States before an event, and the law through them."""

    states: int = 14  # distances double from the width of the bracket on: 1e-6 to 8e-3
    fewest: int = 6  # states of the fit: two more than its coefficients
    powers: tuple[int, ...] = (0, 2, 3, 4)  # of lambda
    spread: float = 2e-4  # root mean square of the residuals over distances; with more, the farthest state is left out
    beside: float = 0.5  # width of the bracket by which the critical strain may lie outside
    finite: float = 0.1  # change of an eigenvalue over the last doublings below which it does not vanish
    modes: int = 4  # beside zero modes, among which one is followed by its overlap


SOFTENING = SofteningFit()

Ending = Literal["fold", "contact change", "unresolved"]


@dataclass(frozen=True, eq=False)
class Softening(Result):
    """Lowest mode of the minima before an event, m of them, the nearest to the event first.

    Attributes:
        distance: (m,) strain from each of them to the last minimum before the event.
        eigenvalues: (m,) of the mode, energy per length squared; zero modes and rattlers are left out.
        kept: (m,) bool, whether the last minimum has the same contacts, so that the Hessian has not jumped.
        vector: (n_sites, 2) the mode at the last minimum, of length 1; 0 for rattlers.
        area_change: at constant pressure the part of the mode along the area, log(area) times sqrt(area); its
            square and that of `vector` add up to 1.
        ending: "fold": the eigenvalue vanishes as the square root, within the bracket. "contact change": it does not
            change on the way to the event, and a contact that opens or closes there ends the minimum. "unresolved":
            neither is seen so far from the event, as contacts change or weaken on the way to it; take a smaller
            `event_width`.
        critical_strain, critical_strain_stderr: where it vanishes, with the standard error of the fit; nan but for a
            fold.
        prefactor, prefactor_stderr: a of lambda = a sqrt(critical_strain - strain).
        exponent, exponent_stderr: power of the distance to `critical_strain` that fits the same states; 1/2 near a
            fold, with the error of the scatter alone.
        fitted: number of states of the fit.
        unit: of eigenvalues, for labels.

    Example:
        >>> p = jamlab.pack(16, 0.2, seed=5)
        >>> run = jamlab.quasistatic_shear(p, strain=0.05, strain_step=5e-3, event_width=1e-6)
        >>> soft = jamlab.softening(run)
        >>> soft.ending, bool(abs(soft.exponent - 0.5) < 0.05)
        ('fold', True)
    """

    _rows = ("distance", "eigenvalues", "kept")
    _apart = ("vector",)

    distance: Array
    eigenvalues: Array
    kept: Array
    vector: Array
    area_change: float
    ending: Ending
    critical_strain: float
    critical_strain_stderr: float
    prefactor: float
    prefactor_stderr: float
    exponent: float
    exponent_stderr: float
    fitted: int
    strain: float  # of the last minimum before the event
    width: float  # of the bracket
    packing: Packing = field(repr=False)  # the last minimum
    unit: str = field(default="", repr=False)

    @drawn('Line2D of the eigenvalues, such as color="k"')
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw the eigenvalue over the distance to the critical strain, or, without one, to the end of the bracket.

        >>> p = jamlab.pack(16, 0.2, seed=5)
        >>> run = jamlab.quasistatic_shear(p, strain=0.05, strain_step=5e-3, event_width=1e-6)
        >>> ax = jamlab.softening(run).plot()
        """
        fold = self.ending == "fold"
        end = abs(self.critical_strain - self.strain) if fold else self.width
        x = self.distance + end
        look = {"color": BLUE, "marker": "o", "markersize": 4, "linestyle": "none", "label": self.ending}
        axes.loglog(x, self.eigenvalues, **merged_line(look, style))
        if fold:
            label = rf"$a\,(\gamma_c-\gamma)^{{1/2}}$, $a$ = {self.prefactor:.3g}"
            axes.loglog(x, self.prefactor * np.sqrt(x), color=BLACK, linewidth=1.0, label=label)
        name = r"distance $|\gamma_c-\gamma|$" if fold else "distance to the end of the bracket, in strain"
        label_axes(axes, name, in_unit(r"lowest eigenvalue $\lambda$", self.unit))
        axes.legend(fontsize=LEGEND)


@dataclass(frozen=True)
class _Later(Shearing):
    """A direction of shear that has gone on for some strain."""

    begun: float

    def at(self, strain: float) -> ShearDirection:
        """The direction as it stands in the box after a strain."""
        return super().at(self.begun + strain)


@checked
def softening(run: QuasistaticShear, event: int = 0) -> Softening:
    """Follow the lowest mode of a packing away from a plastic event, and fit where its eigenvalue vanishes.

    The packing on the near side of the bracket is sheared back by steps that double from the width of the bracket on,
    13 of them, or until it leaves its minimum.

    Args:
        run: quasi-static shear with `event_width`.
        event: number of the event among `run.events`; negative ones count from the last.

    Returns:
        Eigenvalues over the distance, the mode, critical strain and prefactor with errors, and how the minimum ends.

    Raises:
        InputError: events without packings on both sides, or no such event.

    Example:
        >>> run = jamlab.quasistatic_shear(jamlab.pack(32, 1e-2, seed=3), 0.03, strain_step=5e-3, event_width=1e-6)
        >>> soft = jamlab.softening(run)
        >>> soft.ending, bool(soft.eigenvalues[0] > 1e-3)
        ('contact change', True)
    """
    events = run.events
    if run.event_width is None:
        raise InputError("run: its events have no packings on both sides; give quasistatic_shear(..., event_width=...)")
    if not -len(events) <= event < len(events):
        raise InputError(f"{named('event', event)}: the run has {len(events)} events, numbered from 0")
    row = int(np.flatnonzero(run.event)[event]) - 1
    width, onward = float(events.width[event]), float(np.sign(run.strain[row + 1] - run.strain[row]))
    path = _states_before(run, events.before[event], float(run.strain[row]), width, onward)
    found = _followed([packing for _, packing in path], run.held_pressure)
    distance, eigenvalues = np.array([back for back, _ in path]), np.array([value for value, _ in found])
    first = bearing_contacts(path[0][1])
    kept = np.logical_and.accumulate([bearing_contacts(packing) == first for _, packing in path])
    smooth = int(kept.sum())
    law = _fitted(distance[:smooth], eigenvalues[:smooth], width)
    strain = float(run.strain[row])
    vector, packing = found[0][1], path[0][1]
    return Softening(
        distance=distance,
        eigenvalues=eigenvalues,
        kept=kept,
        vector=vector[: 2 * len(packing.positions)].reshape(-1, 2),
        area_change=float(vector[2 * len(packing.positions) :].sum()),
        critical_strain=strain + onward * law.pop("ahead"),
        strain=strain,
        width=width,
        packing=packing,
        unit=packing.unit_names.stress,
        **law,
    )


def _states_before(
    run: QuasistaticShear, packing: Packing, strain: float, width: float, onward: float
) -> list[tuple[float, Packing]]:
    """Minima at growing distances before an event, as far as the packing stays in one."""
    start = run.frames[0]
    shearing = _Later(start.box[0], shear_direction(start, run.direction), strain)
    with Walk(packing, shearing, run.force_tolerance, run.held_pressure, {}, None, None) as walk:
        found = [(0.0, packing)]
        for distance in width * 2.0 ** np.arange(SOFTENING.states - 1):
            walk.go_to(-onward * distance)
            if walk.rows[-1].event or not walk.rows[-1].converged:
                break
            found.append((float(distance), walk.packing()))
    return found


def _followed(packings: list[Packing], pressure: float | None) -> list[tuple[float, Array]]:
    """Eigenvalue and vector of the lowest mode of the first packing, and of the mode most like it of each next one."""
    found: list[tuple[float, Array]] = []
    for packing in packings:
        values, vectors = lowest_of_enthalpy(packing, SOFTENING.modes, pressure)
        k = int(np.argmax(np.abs(vectors @ found[-1][1]))) if found else 0
        found.append((float(values[k]), vectors[k]))
    return found


def _fitted(distance: Array, eigenvalues: Array, width: float) -> dict[str, Any]:
    """The law through states (m,) in one smooth part of the landscape; `ahead`: of the critical strain."""
    names = ("ahead", "critical_strain_stderr", "prefactor", "prefactor_stderr", "exponent", "exponent_stderr")
    law: dict[str, Any] = dict.fromkeys(names, np.nan) | {"fitted": 0, "ending": "unresolved"}
    few = SOFTENING.fewest
    if len(distance) >= few and np.ptp(eigenvalues[:few]) < SOFTENING.finite * eigenvalues[0]:
        return law | {"ending": "contact change"}
    for count in range(len(distance), few - 1, -1):
        found, errors, spread = _series(distance[:count], eigenvalues[:count], width)
        ahead, square = float(found[0]), -float(found[1])
        if spread > SOFTENING.spread or square <= 0 or abs(ahead / width - 0.5) > 0.5 + SOFTENING.beside:
            continue
        power = fit_power_law(ahead + distance[:count], eigenvalues[:count])
        numbers = (ahead, errors[0], square**-0.5, 0.5 * square**-1.5 * errors[1])
        every = (*map(float, numbers), float(power.exponents[0]), float(power.exponents_stderr[0]))
        return dict(zip(names, every, strict=True)) | {"fitted": count, "ending": "fold"}
    return law


def _series(distance: Array, eigenvalues: Array, width: float) -> tuple[Array, Array, float]:
    """Coefficients of the strain ahead of the last minimum as a power series of lambda, their standard errors, and the
    root mean square of the residuals over the distances."""
    unit, weight = eigenvalues.max(), 1 / (distance + 0.5 * width)
    design = (eigenvalues[:, None] / unit) ** np.array(SOFTENING.powers) * weight[:, None]
    size = np.sqrt((design**2).sum(axis=0))
    left, values, right = np.linalg.svd(design / size, full_matrices=False)
    found = right.T @ ((left.T @ (-distance * weight)) / values)
    residual = -distance * weight - design @ (found / size)
    free = len(distance) - len(found)
    errors = np.sqrt(((right.T / values) ** 2).sum(axis=1) * (residual @ residual) / free)
    powers = size * unit ** np.array(SOFTENING.powers)
    return found / powers, errors / powers, float(np.sqrt(np.mean(residual**2)))
