"""The base class of force laws, and the programs that evaluate a law beside the analysis.

One law has up to four carriers: its own `__call__`, which the analysis uses; the deck, by a pair style of LAMMPS; the
compiled FIRE of disks; the elastic part of the plugin's `disk/drag` in flow. `PairLaw.carriers` says which there are,
and `jamlab.engine.agreement` compares each with the analysis.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import Any, ClassVar, Literal, Self, TypeAlias

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import EngineError, InputError
from jamlab.laws.parameter import STRENGTHS, Parameter
from jamlab.registry import EXTENDING

Surfaces: TypeAlias = Literal["disks", "rims"]  # that are in contact

# A particle held by fewer forces that push is not in stable equilibrium: two balance only on one line. Boromand et al.
# say "less than 2", which leaves such disks in. The same number is `least` of lammps_inputs/in.sp.contacts, since
# analysis reads no deck; tests/engine/test_decks.py compares the two.
LEAST_CONTACTS = 3


@dataclass(frozen=True)
class LawTrial:
    """Overlaps of two disks over their distance of contact, at which a law is tried."""

    # that of packings well above onset, and where a search ends
    typical: float = 1e-2
    least: float = 1e-14
    most: float = 0.999
    jump: float = 1e-6  # of a force where contacts open, over the stiffness: a rounded 0
    bisections: int = 60  # of its logarithm: float64 has no more digits
    # at which U' and U'' are compared with differences; gaps over the range at which they are, too; the step of
    # differences, over the distance of contact or the range; relative error of what agrees: that of a power 10 is 1e-7
    overlaps: tuple[float, ...] = (0.03, 0.05, 0.08, 0.12)
    gaps: tuple[float, ...] = (0.2, 0.3, 0.7, 0.8)
    step: float = 1e-4
    error: float = 1e-6


TRIAL = LawTrial()

_DISTANCE = re.compile(r"(?<!\w)r(?!\w)")

HIGHEST_OVERLAP = 0.3  # of springs at the pressure 0.3 k: phi = 1.27 and overlaps of 15 % (n = 64)


def formulas(coefficients: Iterable[str]) -> str:
    """Formulas as words of a command of LAMMPS, which computes them; a text with `$(...)` is taken as it is."""
    return " ".join(word if "$(" in word else f"$({word}:%.17g)" for word in coefficients)


@dataclass(frozen=True)
class PairStyle:
    """A pair style of LAMMPS that evaluates a law.

    Attributes:
        style: arguments of `pair_style`, such as "lj/cut 1.0".
        coefficients: arguments of `pair_coeff` for two atom types, as formulas of LAMMPS: `v_s` is the distance of
            contact of the two, `v_eps` the strength as an energy, other parameters of the law go by name; a text with
            `$(...)` is taken as it is, such as '0.5*(r-$(v_s:%.17g))^2' of the style lepton.
        modify: arguments of `pair_modify`, if any.
    """

    NAMES: ClassVar[tuple[str, ...]] = ("pair_style", "pair_coeff", "pair_modify", "law_words")  # variables of decks

    style: str
    coefficients: tuple[str, ...]
    modify: str = ""

    def __post_init__(self) -> None:
        for word in self.coefficients:
            if "$(" not in word and _DISTANCE.search(word):
                raise InputError(
                    f"pair_style {self.style}: coefficient {word!r} contains the distance r, but must be a number. "
                    "For the style lepton write numbers as $(...), such as '0.5*(r-$(v_s:%.17g))^2'"
                )

    def variables(self) -> dict[str, object]:
        """Variables of `lammps_inputs/parts/sp`."""
        found: dict[str, object] = {"pair_style": self.style, "pair_coeff": formulas(self.coefficients)}
        return found | ({"pair_modify": self.modify} if self.modify else {})


@dataclass(frozen=True)
class PairLaw(ABC):
    """A force law of contacts: energy, parameters, and the programs that evaluate it.

    A law of disks derives from it as a frozen dataclass, with a field for each of its `parameters`, and is known by its
    `name` in `jamlab.laws.laws.LAWS`; a law of the rims of droplets derives from `jamlab.laws.rim.RimLaw`.
    """

    name: ClassVar[str]  # in `params["law"]`
    between: ClassVar[Surfaces] = "disks"
    strengths: ClassVar[Mapping[str, Parameter]] = STRENGTHS  # by the units that the law may have
    parameters: ClassVar[Mapping[str, Parameter]] = {}  # beside the strength; declared here alone
    least_contacts: ClassVar[int] = LEAST_CONTACTS  # that hold a particle
    least_bearing: ClassVar[int] = LEAST_CONTACTS  # with which a particle may bear load
    # eigenvalue of a Hessian over the largest element on its diagonal that is rounding: a mode below is floppy.
    # Translations, which cost nothing, come out at 1e-16 to 5e-17 of it (droplets at onset, N = 12 and 64)
    floppy: ClassVar[float] = 16 * float(np.finfo(float).eps)
    # carriers beside `__call__`
    pair_style: ClassVar[PairStyle | None] = None  # of LAMMPS; a property where it depends on parameters
    deck_part: ClassVar[bool] = False  # whether a part of the decks holds the law by itself
    sizes_by_disk: ClassVar[bool] = False  # whether its pair style takes the diameter of each disk, not of its type
    plugin_words: ClassVar[str | None] = None  # of the plugin's `disk/drag`, whose elastic part it then is in flow

    units: str  # "eps" or "k"
    strength: float  # the parameter that the units name

    @classmethod
    def of(cls, params: Mapping[str, Any], units: str, mean_size: float = 1.0) -> Self:
        """The law of a packing. Parameters that are lengths over the mean size become lengths.

        Args:
            params: `Packing.params`.
            units: `Packing.units`.
            mean_size: of the particles.

        Raises:
            InputError: U' is not the derivative of U, or U'' not that of U'.
        """
        own = {name: params.get(name, each.default) for name, each in cls.parameters.items()}
        law = cls(
            units,
            float(params[units]),
            **{name: _scaled(value, cls.parameters[name], mean_size) for name, value in own.items()},
        )
        check_derivatives(law, mean_size)
        return law

    def __str__(self) -> str:
        return f"law {self.name!r}"

    @abstractmethod
    def __call__(self, contact: Array, distance: Array) -> tuple[Array, Array, Array]:
        """Energy U, force U' and stiffness U'' of pairs within the cutoff.

        Args:
            contact: (m,) distance s at which two surfaces meet.
            distance: (m,) r.

        Returns:
            Three (m,) arrays: U, dU/dr, d2U/dr2.
        """

    def energy_of(self, contact: Array) -> Array:
        """(m,) strength of pairs as an energy: eps, or k s^2."""
        return np.full(len(contact), self.strength) if self.units == "eps" else self.strength * contact**2

    @property
    def range(self) -> float:
        """Distance beyond contact up to which the law acts; 0 for pure repulsion, which ends at contact."""
        return 0.0

    @property
    def slack(self) -> float:
        """Largest force of a contact that bears nothing at a minimum: a chain of such contacts is floppy."""
        return 0.0

    def drag_stiffness(self, contact: Array, distance: Array) -> Array:
        """(m,) stiffness in the drag coefficient of each contact, never negative."""
        return np.maximum(self(contact, distance)[2], 0.0)

    @property
    def springs(self) -> bool:
        """Whether the force grows in proportion to the overlap."""
        return False

    # carriers ---------------------------------------------------------------------------------------------------------

    @property
    def carriers(self) -> frozenset[str]:
        """Programs that evaluate the law beside the analysis: "deck", "kernel", "plugin"."""
        has = {
            "deck": self.deck_part or self.pair_style is not None,
            "kernel": self.kernel_arguments() is not None,
            "plugin": self.plugin_words is not None,
        }
        return frozenset(name for name, there in has.items() if there)

    def require(self, carrier: str, what: str) -> None:
        """Refuse a task for which the law has no carrier.

        Args:
            carrier: that the task needs.
            what: the task, in words.

        Raises:
            EngineError: the law has none.
        """
        if carrier not in self.carriers:
            write = {"deck": "pair_style", "kernel": "kernel_arguments", "plugin": "plugin_words"}[carrier]
            raise EngineError(
                f"law {self.name!r} has no {carrier}, which {what} needs: write `{write}` in class "
                f"{type(self).__name__}, see {EXTENDING}"
            )

    def lammps_variables(self) -> dict[str, object]:
        """Variables by which a deck knows the law.

        Raises:
            EngineError: no pair style of LAMMPS is known that evaluates it.
        """
        self.require("deck", "LAMMPS")
        own = {each.name: getattr(self, each.name) for each in fields(self) if each.name not in ("units", "strength")}
        found: dict[str, object] = {"units": self.units, self.units: self.strength, **own}
        if self.pair_style is None:
            return found
        return {**found, "shell": 0.5 * self.range, **self.pair_style.variables()}

    def kernel_arguments(self) -> tuple[float, int, float] | None:
        """Arguments of the compiled FIRE of disks; None if it does not have the law: then LAMMPS alone minimises."""
        return None

    @property
    def power_of_contact(self) -> float:
        """Exponent p of a strength ~ s^p, by which pair styles of LAMMPS scale where each disk has its own size."""
        return 0.0

    # near onset, lengths in the unit of length ------------------------------------------------------------------------

    @property
    def stiffness(self) -> float:
        """Stiffness of a contact over the strength, by which natural units go: time steps and tolerances."""
        found = self._at(TRIAL.typical)[2] / self.strength
        if not (np.isfinite(found) and found > 0):
            raise InputError(
                f"{self}: the stiffness U'' of disks that overlap by {TRIAL.typical:g} of their distance of contact is "
                f"{found:.6g}, must be positive: check the derivatives of {type(self).__name__}, see {EXTENDING}"
            )
        if not self.range and not (jump := abs(self._at(TRIAL.least)[1])) <= TRIAL.jump * found * self.strength:
            raise InputError(
                f"{self}: the force of disks that just touch is {jump:.6g}, must be 0, or no state with contacts has a "
                f"minimum: subtract the force at contact in {type(self).__name__}, as pair styles with `shift/force` do"
            )
        return found

    @property
    def pressures(self) -> tuple[float, float]:
        """Least and highest pressure of packings at mean size 1: beyond, disks pass through each other."""
        highest = self.pressure_at(HIGHEST_OVERLAP)
        return (-highest if self.range else 0.0), highest

    def linear_in_phi(self, pressure: float) -> float:
        """Measure of phi - phi_J above onset, from the pressure: the overlap of two disks at this force."""
        return self._overlap(lambda found: -found[1], pressure)

    def pressure_at(self, overlap: float) -> float:
        """Pressure whose `linear_in_phi` is the overlap."""
        return -self._at(overlap)[1]

    def stiffness_at(self, pressure: float) -> float:
        """Typical stiffness of contacts at a pressure, over `stiffness` times the strength."""
        return self._at(self._overlap(lambda found: -found[1], pressure))[2] / (self.stiffness * self.strength)

    def force_at(self, energy: float) -> float:
        """Typical contact force at a contact energy per disk."""
        return -self._at(self._overlap(lambda found: found[0], energy))[1]

    def beside_springs(self, energy: float) -> float:
        """Typical contact force over the force of springs, at a contact energy per disk in units of the stiffness."""
        unit = self.stiffness * self.strength
        return self.force_at(energy * unit) / (float(np.sqrt(2 * energy)) * unit)

    def root_energy(self, energy: float) -> float:
        """Measure of phi - phi_J above onset, from the contact energy: the overlap of two disks of this energy."""
        return self._overlap(lambda found: found[0], energy)

    def _at(self, overlap: float) -> tuple[float, float, float]:
        """U, U' and U'' of two disks that touch at the unit of length."""
        energy, slope, stiffness = self(np.ones(1), np.array([1.0 - overlap]))
        return float(energy[0]), float(slope[0]), float(stiffness[0])

    def _overlap(self, grows: Callable[[tuple[float, float, float]], float], value: float) -> float:
        """Overlap of two disks that touch at the unit of length, by bisection of what grows with it."""
        if value <= 0:
            return 0.0
        low, high = np.log(TRIAL.least), np.log(TRIAL.most)
        for _ in range(TRIAL.bisections):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if grows(self._at(float(np.exp(middle)))) < value else (low, middle)
        return float(np.exp(0.5 * (low + high)))


@lru_cache(maxsize=1024)
def check_derivatives(law: PairLaw, contact: float) -> None:
    """Refuse a law whose U' or U'' is no derivative. No other carrier has U'', on which linear response rests.

    Args:
        law: with its numbers.
        contact: distance s at which its derivatives are compared with differences.

    Raises:
        InputError: with both figures.
    """
    places = [contact * (1 - np.array(TRIAL.overlaps))]
    if law.range > 100 * TRIAL.step * contact:
        places.append(contact + law.range * np.array(TRIAL.gaps))
    step, steps = TRIAL.step * min(contact, law.range or contact), np.arange(-2, 3)
    for r in places:
        asked = (r[:, None] + step * steps).ravel()
        with np.errstate(all="ignore"):
            values = [each.reshape(-1, 5) for each in law(np.full(len(asked), contact), asked)]
        slopes = [each @ np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / (12 * step) for each in values[:2]]  # fourth order
        for (name, of), slope, said in zip((("U'", "U"), ("U''", "U'")), slopes, values[1:], strict=True):
            wrong = np.abs(slope - said[:, 2]) > TRIAL.error * np.abs(said[:, 2])
            if 2 * wrong.sum() > len(r):  # at a kink no difference is a derivative, so most places have to be wrong
                k = int(wrong.argmax())
                raise InputError(
                    f"{law}: at r = {r[k]:.6g}, contact at {contact:.6g}, its {name} is {said[k, 2]:.9g}, but {of} "
                    f"changes with r by {slope[k]:.9g}: check the derivatives of {type(law).__name__}, see {EXTENDING}"
                )


def _scaled(value: Any, parameter: Parameter, mean_size: float) -> Any:
    if parameter.choices:
        return value
    return float(value) * (mean_size if parameter.over_size else 1.0)
