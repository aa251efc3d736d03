"""Tables of a campaign file that say which flows are run: steady, oscillating, creeping."""

from typing import Annotated

from pydantic import Field, field_validator

from jamlab.campaign.file_values import FileTable, Frequencies, Rates
from jamlab.flow.creep import LONGEST
from jamlab.flow.oscillate import LARGEST_AMPLITUDE, MOST_CYCLES
from jamlab.flow.overdamped_session import LARGEST_TOLERANCE, LEAST_TOLERANCE
from jamlab.flow.quasistatic_shear import LARGEST_STEP
from jamlab.flow.shear import LARGEST_RATE
from jamlab.rheology.damping import LEAST_ALPHA

FLOWS = {  # observables of flow in time, each with a table of that name, and what to give in it
    "flow": "a table with rates",
    "oscillation": "a table with omega and amplitudes",
    "creep": "a table with stresses and duration",
}

Alpha = Annotated[float, Field(ge=LEAST_ALPHA, le=1)]
Background = Annotated[float, Field(ge=0, le=1e3)]
FlowTolerance = Annotated[float, Field(ge=LEAST_TOLERANCE, le=LARGEST_TOLERANCE)]


class Flow(FileTable):
    """Steady flow, and the start-up before it, of every state by every damping law, as by `jamlab.flow_curve`.

    Attributes:
        rates: of shear, 1/tau_1: a list, or { lowest, highest, points } for even spacing in log rate. 0: quasi-static.
        strain: of the average.
        discard: strain of start-up before.
        step: of strain, at rate 0.
        alpha: power of the velocity in contact damping, 1 is linear.
        background: drag beside contact damping, over k tau_1; by default that of `jamlab.shear`.
        tolerance: relative error of velocities in a step.
        last: true: only of the last state of each packing.
    """

    rates: Rates
    strain: Annotated[float, Field(ge=1, le=1000)] = 4.0
    discard: Annotated[float, Field(gt=0, le=1000)] = 1.0
    step: Annotated[float, Field(ge=1e-6, le=LARGEST_STEP)] = 1e-3
    alpha: Alpha = 1.0
    background: Background | None = None
    tolerance: FlowTolerance = 1e-2
    last: bool = False

    @field_validator("rates")
    @classmethod
    def _check_rates(cls, value: list[float]) -> list[float]:
        if max(value) > LARGEST_RATE:
            raise ValueError(f"{max(value):g} is above {LARGEST_RATE:g}, the fastest flow there is: lower it")
        return value


class Oscillating(FileTable):
    """Arguments of `jamlab.oscillate`, for every state, damping law, frequency and amplitude.

    Attributes:
        omega: frequencies, 1/tau_1.
        amplitudes: of the strain; both are lists, or { lowest, highest, points } for even spacing in the logarithm.
        alpha, background, tolerance: see `Flow`.
        cycles: at most.
    """

    omega: Frequencies
    amplitudes: Frequencies
    alpha: Alpha = 1.0
    cycles: Annotated[int, Field(ge=2, le=MOST_CYCLES)] = 20
    background: Background = 0.0
    tolerance: FlowTolerance = 1e-3

    @field_validator("amplitudes")
    @classmethod
    def _check_amplitudes(cls, value: list[float]) -> list[float]:
        if max(value) > LARGEST_AMPLITUDE:
            raise ValueError(f"{max(value):g} is above {LARGEST_AMPLITUDE:g}, the largest strain there is: lower it")
        return value


class Creeping(FileTable):
    """Arguments of `jamlab.creep`, for every state, damping law and stress.

    Attributes:
        stresses: beside the residual one, in the packing's unit.
        duration: time, tau_1.
        largest_strain: at which a run ends early.
        alpha, background, tolerance: see `Flow`.
    """

    stresses: Frequencies
    duration: Annotated[float, Field(gt=0, le=LONGEST)]
    largest_strain: Annotated[float, Field(gt=0, le=1e4)] = 1.0
    alpha: Alpha = 1.0
    background: Background = 0.0
    tolerance: FlowTolerance = 1e-3
