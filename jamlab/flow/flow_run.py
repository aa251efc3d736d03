"""What every flow gives: its rows, the packings on the way, its drag and accuracy, and its energy balance.

Work that flow does on a packing is stored or lost. Steps integrate positions, work and dissipation each on their own,
so the gap between the three measures the errors of the steps.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any, ClassVar

import numpy as np

from jamlab.arrays import Array, Indices
from jamlab.flow.report import conclude, report, say_balance
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.plotting.drawable import LEGEND, label_axes, merged_line, positive
from jamlab.plotting.palette import COLOURS
from jamlab.rheology.drag_law import DragLaw

SERIES = (  # arrays of a result, one value a row
    *("time", "strain", "rate", "stress", "elastic_stress", "viscous_stress", "pressure"),
    *("normal_stress_difference", "dissipation", "energy", "work", "dissipated", "contacts"),
)


@dataclass(frozen=True)
class FlowEnergy:
    """Balance of energy of a flow, and what makes it better."""

    rounding: float = 1e-13  # of an energy that is a sum over all contacts and edges
    # drag beside that of contacts, over k tau_1. Droplets lose less of their work with it: without, finer steps
    # did not help, four flows lost .013 to 113 of it; with it 3e-5 to .006. Flows of disks that find no step go
    # on with it, and their mean stress moves by less than 3 %
    background: float = 1e-2
    finer: float = 0.1  # tolerance to try next, over the present one; steps go as its root, errors as steps squared


FLOW_ENERGY = FlowEnergy()


def energy_gap(work: Array, lost: Array, energy: Array) -> Array:
    """(m,) work less dissipation and stored energy since the first row: 0 except for step errors, and 0 where it is no
    more than the sum of all energies rounds off."""
    gap = work - lost - energy
    gap = gap - gap[0]
    return np.where(np.abs(gap) > FLOW_ENERGY.rounding * np.abs(energy).max(), gap, 0.0)


def energy_imbalance(gap: Array, work: Array, lost: Array) -> float:
    """Largest gap (m,) over the larger of work (m,) and loss (m,); 0 where nothing is done."""
    scale = max(float(np.abs(values - values[0]).max()) for values in (work, lost))
    return float(np.abs(gap).max()) / scale if scale > 0 else 0.0


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class FlowResult(Result):
    """One flow or several: packings, drag and accuracy. The energy balance stands in its `repr` and its pictures."""

    columns: ClassVar[tuple[str, ...]]  # of its table
    numbers: ClassVar[tuple[str, ...]] = ("state", "energy_error", "conclusion")  # beside its fields, of `to_dict`

    # packings at the start, on the way if asked for, and at the end; strain and time in their provenance
    frames: tuple[Packing, ...]
    damping: DragLaw | None  # drag law; None without rate
    background_drag: float  # of every disk or vertex against the affine flow beside `damping`, over k tau_1
    tolerance: float | None  # relative error of velocities in a step; None without rate
    unit: str  # of stress, for labels

    __repr__ = report

    @property
    def energy_tolerance(self) -> float:
        """Imbalance from which on the result is doubtful: the tolerance."""
        assert self.tolerance is not None  # without rate the result has a limit of its own
        return self.tolerance

    @property
    def remedy(self) -> dict[str, float]:
        """Argument to change where energy is not balanced: shorter steps, or a background drag for droplets."""
        drags = self.damping is not None and self.damping.at_contacts
        if self.frames[0].kind.carrier == "outlines" and drags and self.background_drag < FLOW_ENERGY.background:
            return {"background_drag": FLOW_ENERGY.background}
        return {"tolerance": FLOW_ENERGY.finer * self.energy_tolerance}

    @property
    def conclusion(self) -> str:
        """State and numbers in words, and what to change if energy is not balanced to the tolerance."""
        return conclude(self)

    def _columns(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in self.columns}

    def to_dict(self) -> dict[str, Any]:
        """All numbers by the names of attributes, as JSON holds them: columns of the table as lists, what the whole run
        has, and its drag law as a dict; of complex numbers the real and the imaginary part. Packings are left out."""
        known = {each.name for each in fields(self)} - {"frames"} | {*self.columns, *self.numbers, *self._columns()}
        found = {name: getattr(self, name) for name in sorted(known)} | {"damping": None}
        if (law := self.damping) is not None:
            found["damping"] = {"name": law.name, **{name: getattr(law, name) for name in law.parameters()}}
        return {name: _plain(value) for name, value in found.items()}


def _plain(value: Any) -> Any:
    """A number, or an array as lists, without complex numbers."""
    if isinstance(value, np.ndarray):
        return (np.stack([value.real, value.imag], axis=-1) if np.iscomplexobj(value) else value).tolist()
    return value


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class FlowRun(FlowResult):
    """A flow: m rows, in the packing's unit of stress and with times in tau_1."""

    series: ClassVar[tuple[str, ...]] = SERIES
    answer: ClassVar[str] = "stress"  # which of them the packing decides
    columns: ClassVar[tuple[str, ...]] = (*SERIES, "z_all", "energy_gap")
    numbers: ClassVar[tuple[str, ...]] = (*FlowResult.numbers, "finished", "balanced", "relative_trajectory_error")
    _apart: ClassVar[tuple[str, ...]] = ("wall_stress",)

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
    pressure: Array  # (m,) both parts of the forces, positive in compression; between walls the normal stress on them
    normal_stress_difference: Array  # (m,) N_1 = sigma_xx - sigma_yy, tension positive
    dissipation: Array  # (m,) per time and area; in steady flow stress times rate
    energy: Array  # (m,) elastic, per area
    # work, dissipated: (m,) done and lost since the start, per area, over all steps
    work: Array
    dissipated: Array
    contacts: Array  # (m,) pairs of particles that press on each other
    # steps, iterations: of time, and of the solver over all of them
    steps: int
    iterations: int
    seconds: float  # wall time
    # times that several disks which touch with no gap decided on each other, and no states of them fitted: the
    # closest were taken
    ambiguous_contacts: int = 0
    # (m,) largest difference so far of the stress, in creep of the strain, from the same run at a tenth of the
    # tolerance; (0,) where it was not measured
    trajectory_error: Array = field(default_factory=lambda: np.zeros(0))
    # (m, 2, 2) shear stress and pressure on the lower and on the upper wall; (0, 2, 2) without walls
    wall_stress: Array = field(default_factory=lambda: np.zeros((0, 2, 2)))

    @property
    def packing(self) -> Packing:
        """The last state; no energy minimum: `converged` is False."""
        return self.frames[-1]

    @property
    def frame_rows(self) -> Indices:
        """(f,) row of each of the `frames`, by its strain."""
        strain = [packing.provenance["flow_strain"] for packing in self.frames]
        return np.array([int(np.abs(self.strain - each).argmin()) for each in strain])

    @property
    def z_all(self) -> Array:
        """(m,) 2 N_c/N of all contacts that press, as `Contacts.z_all`; in motion no rule tells rattlers."""
        return np.asarray(2 * self.contacts / self.packing.n)

    @property
    def energy_gap(self) -> Array:
        """(m,) work less dissipation and stored energy since the first row; 0 except for step errors."""
        return energy_gap(self.work, self.dissipated, self.energy)

    @property
    def energy_error(self) -> float:
        """Largest part of the work that is neither stored nor lost: work less dissipated less change of energy."""
        return energy_imbalance(self.energy_gap, self.work, self.dissipated)

    @property
    def relative_trajectory_error(self) -> float:
        """Last `trajectory_error` over the largest stress, in creep the largest strain; nan if not measured."""
        scale = float(np.abs(getattr(self, self.answer)).max())
        return float(self.trajectory_error[-1]) / scale if len(self.trajectory_error) and scale else float("nan")

    def _columns(self) -> dict[str, Any]:
        measured = {"trajectory_error": self.trajectory_error} if len(self.trajectory_error) else {}
        return super()._columns() | measured

    @property
    def balanced(self) -> bool:
        """Whether energy is balanced within the tolerance: the steps follow the forces. The trajectory may still differ
        from the exact one, see `trajectory_error`."""
        return self.energy_error <= self.energy_tolerance

    def _draw(self, axes: Any, time: Array, values: Array, name: str, label: str, **style: Any) -> None:
        """Draw values (m,) over time (m,), both logarithmic; the legend counts values that are not positive."""
        shown, left_out = positive(values)
        look = {"color": COLOURS[len(axes.lines) % len(COLOURS)], "linewidth": 1.6, "label": name + left_out}
        axes.loglog(time, shown, **merged_line(look, style))
        label_axes(axes, r"time $t/\tau_1$", label)
        axes.legend(fontsize=LEGEND)
        say_balance(axes, self)
