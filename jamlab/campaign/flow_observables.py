"""Observables that drive the states of a task: steady flow and its start-up, quasi-static shear, oscillation, creep;
a row a run.

A run that has no answer, such as one whose drag is too weak to be resolved, has nan and is not converged.
"""

import math
from abc import abstractmethod
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import BeforeValidator, Field

from jamlab.campaign.keys import usual, within
from jamlab.campaign.observable import DAMPING, STATE, Driven, FileTable, Grid, Observable, Row
from jamlab.errors import ConvergenceError
from jamlab.flow.creep_and_relaxation import creep
from jamlab.flow.flow_curve import ROWS, steady_point
from jamlab.flow.oscillate import oscillate
from jamlab.flow.overdamped_session import check_flowing
from jamlab.flow.quasistatic_shear import quasistatic_shear
from jamlab.flow.shear import ShearRun, shear
from jamlab.packing.packing import Packing
from jamlab.rheology.damping import DRAG_LIMITS
from jamlab.rheology.drag_law import DragLaw
from jamlab.rheology.nonlinear_drag import equivalent_modulus
from jamlab.statistics.confidence import AVERAGES


def _above_zero(rate: float) -> float:
    if rate == 0:
        raise ValueError("its limit of rate 0 is the observable 'quasistatic_shear': leave 0 out, and add that")
    return rate


class _Driving(FileTable):
    """What all tables of driven packings have."""

    alpha: Annotated[float, Field(ge=DRAG_LIMITS.alpha, le=1)] = 1.0  # power in contact damping
    background_drag: Annotated[float, within("background_drag")] | None = usual("background_drag")
    tolerance: Annotated[float, within("tolerance")] = usual("tolerance")


class Flowing(_Driving):
    """Steady flow, and the start-up before it, of every state by every damping law, as by `jamlab.flow_curve`."""

    rates: Grid[Annotated[float, BeforeValidator(_above_zero), within("rates")]]
    strain: Annotated[float, within("strain", "sweep.flow")] = usual("strain", "sweep.flow")
    discard: Annotated[float, within("discard", "sweep.flow")] = usual("discard")
    background_drag: Annotated[float, within("background_drag")] | None = usual("background_drag", "sweep.flow")
    tolerance: Annotated[float, within("tolerance")] = usual("tolerance", "sweep.flow")


_QUASISTATIC = "sweep.quasistatic_shear"


class QuasistaticShearing(FileTable):
    """Quasi-static shear of every state, the limit of steady flow at a vanishing rate, as by
    `jamlab.quasistatic_shear`."""

    strain: Annotated[float, within("strain", _QUASISTATIC)] = usual("strain", _QUASISTATIC)
    discard: Annotated[float, within("discard", _QUASISTATIC)] = usual("discard")
    strain_step: Annotated[float, within("strain_step", _QUASISTATIC)] = usual("strain_step")
    force_tolerance: Annotated[float, within("force_tolerance")] | None = usual("force_tolerance")


class Oscillating(_Driving):
    """Arguments of `jamlab.oscillate`, for every state, damping law, frequency and amplitude."""

    omega: Grid[Annotated[float, within("omega", "sweep.oscillation")]]
    amplitudes: Grid[Annotated[float, within("amplitudes")]]
    cycles: Annotated[int, within("cycles")] = usual("cycles")


class Creeping(_Driving):
    """Arguments of `jamlab.creep`, for every state, damping law and stress."""

    stresses: Grid[Annotated[float, within("stresses")]]
    duration: Annotated[float, within("duration")]
    largest_strain: Annotated[float, within("largest_strain")] = usual("largest_strain")


_SLOW = 1e-3  # rate, 1/tau_1, below which a unit of strain takes more steps: at 1e-4 3.7 times the CPU time, 32 disks
_BESIDE = ("flow_pressure", "flow_pressure_stderr", "peak_stress", "peak_strain")  # of runs under shear


class _Run(Driven):
    """An observable with a row for each state, damping law and point of its table of the campaign file."""

    _FLOW: ClassVar = ("phi", "rho", "background_drag", "tolerance", *STATE, *DAMPING, "alpha")
    _ENDED: ClassVar = ("ambiguous_contacts", "converged")  # contact changes, as in `FlowRun`

    @property
    def how(self) -> Any:
        """Table of the campaign file, which has the name of the observable."""
        return getattr(self, self.name)

    @property
    def fineness(self) -> float:
        """Number of steps over that at a tolerance of 1e-2; their errors fall as the cube of their length."""
        return float((1e-2 / self.how.tolerance) ** (1 / 3))

    @abstractmethod
    def points(self) -> list[dict[str, float]]:
        """List what differs from run to run."""

    @abstractmethod
    def drive(self, packing: Packing, law: DragLaw, row: Row) -> Row:
        """Run once by the law and the point that stand in a row, and return the columns of this run."""

    def laws(self) -> list[tuple[DragLaw, Row]]:
        return self.damping.with_columns(self.how.alpha)

    def check(self, sites: float) -> None:
        super().check(sites)
        for key in ("alpha", "background_drag"):
            laws = self.damping.contact or (key == "background_drag" and self.damping.others)
            if key in self.how.model_fields_set and not laws:
                said = f"{self.name}.{key} applies to contact damping, but damping has none"
                raise ValueError(f"{said}: leave it out")

    def check_law(self, law: DragLaw) -> None:
        background = self.how.background_drag if law.at_contacts else None
        check_flowing(law, self.how.tolerance, background or 0.0)

    def cases(self) -> list[tuple[dict[str, Any], Row]]:
        background = np.nan if self.how.background_drag is None else self.how.background_drag
        settings = {"background_drag": background, "tolerance": self.how.tolerance}
        points = [settings | point for point in self.points()]
        return [({"law": law, "row": columns | p}, columns | p) for law, columns in self.laws() for p in points]

    def one(self, packing: Packing, **how: Any) -> list[Row]:
        return [self.drive(packing, **how)]

    def refused(self) -> list[Row]:
        return [{}]


class SteadyFlow(_Run):
    """Steady shear and its start-up at each rate."""

    name, needs = "flow", "a table with rates"
    _STEADY: ClassVar = (  # means of `FlowCurve`; its pressure has another name than the pressure of the state
        *("stress", "stress_stderr", "elastic_stress", "elastic_stress_stderr", "normal_stress_difference"),
        *("normal_stress_difference_stderr", "dissipation", "plastic_events", "z_all", "z_all_stderr"),
    )
    columns = (*_Run._FLOW, "rate", *_STEADY, *_BESIDE, *_Run._ENDED)

    flow: Flowing

    def points(self) -> list[dict[str, float]]:
        return [{"rate": rate} for rate in self.flow.rates]

    def amount(self) -> float:
        slow = sum(max(1.0, math.sqrt(_SLOW / rate)) for rate in self.flow.rates)
        return len(self.laws()) * slow * (self.flow.strain + self.flow.discard) * self.fineness

    def drive(self, packing: Packing, law: DragLaw, row: Row) -> Row:
        how = self.flow
        strain = how.strain + how.discard
        background = how.background_drag if law.at_contacts else None  # Stokes drag is itself one
        accuracy: Any = {"tolerance": how.tolerance, "background_drag": background}
        run = shear(packing, row["rate"], strain, law, rows=int(np.ceil(ROWS * strain)), **accuracy)
        return _steady(run, how.discard, self._STEADY) | {"ambiguous_contacts": float(run.ambiguous_contacts)}


class QuasistaticShearOfStates(Observable):
    """Quasi-static shear: means beyond the start-up, without drag."""

    name = "quasistatic_shear"
    _STEADY: ClassVar = (
        *("stress", "stress_stderr", "normal_stress_difference", "normal_stress_difference_stderr"),
        *("plastic_events", "z_all", "z_all_stderr", "mu", "mu_stderr"),
    )
    columns = ("phi", "rho", *STATE, *_STEADY, *_BESIDE, "converged")

    quasistatic_shear: QuasistaticShearing = QuasistaticShearing()

    def check(self, sites: float) -> None:
        how = self.quasistatic_shear
        if (steps := round(how.strain / how.strain_step)) < 2 * AVERAGES.blocks:
            least = f"a strain of {how.strain:g} has {steps} steps, and its mean needs {2 * AVERAGES.blocks} or more"
            raise ValueError(f"quasistatic_shear.strain_step = {how.strain_step:g}: {least}: lower it")

    def amount(self) -> float:
        how = self.quasistatic_shear
        return (how.strain + how.discard) / how.strain_step

    def one(self, packing: Packing, **_: Any) -> list[Row]:
        how = self.quasistatic_shear
        strain = how.strain + how.discard
        run = quasistatic_shear(packing, strain, how.strain_step, force_tolerance=how.force_tolerance)
        return [_steady(run, how.discard, self._STEADY)]

    def refused(self) -> list[Row]:
        return [{}]


def _steady(run: ShearRun, discard: float, names: tuple[str, ...]) -> Row:
    """Means of a run beyond its start-up, with its overshoot."""
    steady, peak = run.steady(discard), run.peak
    mean = steady_point(run, discard) | {"mu": steady.mu, "mu_stderr": steady.mu_stderr}
    return {
        **{name: mean[name] for name in names},
        "flow_pressure": mean["pressure"],
        "flow_pressure_stderr": mean["pressure_stderr"],
        "peak_stress": peak.stress if peak else np.nan,
        "peak_strain": peak.strain if peak else np.nan,
        "converged": steady.steady,
    }


class OscillationOfStates(_Run):
    """First harmonic of the stress at each frequency and amplitude, beside the linear answer by equivalent damping."""

    name, needs = "oscillation", "a table with omega and amplitudes"
    _OF_RUN: ClassVar = ("storage", "loss", "third_over_first", "change")  # change: relative, of the last cycle
    _EQUIVALENT: ClassVar = ("equivalent_storage", "equivalent_loss", "equivalent_time")
    columns = (*_Run._FLOW, "omega", "amplitude", *_OF_RUN, *_EQUIVALENT, *_Run._ENDED)

    oscillation: Oscillating

    def points(self) -> list[dict[str, float]]:
        how = self.oscillation
        return [{"omega": omega, "amplitude": amplitude} for omega in how.omega for amplitude in how.amplitudes]

    def amount(self) -> float:
        return len(self.cases()) * self.oscillation.cycles * self.fineness

    def drive(self, packing: Packing, law: DragLaw, row: Row) -> Row:
        how = self.oscillation
        background = how.background_drag if law.at_contacts else 0.0  # Stokes drag is itself one
        accuracy: Any = {"cycles": how.cycles, "tolerance": how.tolerance, "background_drag": background}
        run = oscillate(packing, row["omega"], row["amplitude"], law, **accuracy)
        stress = row["amplitude"] * abs(complex(run.storage, run.loss))
        found: Row = {name: getattr(run, name) for name in self._OF_RUN} | {
            "ambiguous_contacts": float(run.ambiguous_contacts)
        }
        return found | {"converged": run.finished} | self._equivalent(packing, law, row, stress)

    def _equivalent(self, packing: Packing, law: DragLaw, row: Row, stress: float) -> Row:
        """Linear answer at the stress that was seen, [T] eqs 23-29; nan for other than balanced contact damping."""
        if row["beta"] != 1:  # nan for other laws
            return {}
        try:
            linear, _ = equivalent_modulus(packing, [row["omega"]], law, stress=stress)
        except ConvergenceError:  # not jammed, or unstable in a fixed box
            return {}
        return dict(zip(self._EQUIVALENT, (linear.storage[0], linear.loss[0], linear.tau[0]), strict=True))


class CreepOfStates(_Run):
    """Strain under each stress beside the residual one: where it ends, and whether the packing rests or flows; it is
    converged if it does either."""

    name, needs = "creep", "a table with stresses and duration"
    _OF_RUN: ClassVar = ("residual_stress", "final_time", "final_strain", "final_rate", "slope", "rests", "flows")
    columns = (*_Run._FLOW, "stress", *_OF_RUN, *_Run._ENDED)

    creep: Creeping

    def check_law(self, law: DragLaw) -> None:
        super().check_law(law)
        if not law.at_contacts and 0.0 in self.damping.stokes:
            raise ValueError("creep under Stokes drag of eta_f = 0 has no bound: leave 0 out of damping.stokes")

    def points(self) -> list[dict[str, float]]:
        return [{"stress": stress} for stress in self.creep.stresses]

    def drive(self, packing: Packing, law: DragLaw, row: Row) -> Row:
        how = self.creep
        background = how.background_drag if law.at_contacts else 0.0  # Stokes drag is itself one
        accuracy: Any = {"tolerance": how.tolerance, "background_drag": background}
        run = creep(packing, row["stress"], how.duration, law, largest_strain=how.largest_strain, **accuracy)
        return {
            **{"residual_stress": run.residual_stress, "final_rate": run.final_rate, "slope": run.slope},
            **{"final_time": float(run.time[-1]), "final_strain": float(run.strain[-1])},
            **{"rests": float(run.state == "rests"), "flows": float(run.state == "flows")},
            **{"ambiguous_contacts": float(run.ambiguous_contacts), "converged": run.finished},
        }
