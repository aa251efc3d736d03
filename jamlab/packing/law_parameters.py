"""What a force law says, what its parameters may be, names of units, ensembles and contact forms, limits on lengths.

Beyond these limits numbers overflow or lose their digits, and searches never end.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import as_plain, check_choice, is_number
from jamlab.errors import InputError

LONGEST = 1e100  # areas, their squares and ratios then stay far from the ends of float64, 1e308 and 1e-308
FLATTEST = 1e6  # width over height of the box, and tilt over width: a search walks over as many images
FARTHEST = 1e9  # distance from the origin over the size of the box: float64 then keeps seven digits of where in the box
DENSEST = 1e3  # sum of squared sizes over the area of the box: pairs that overlap grow alike; jammed packings are at 1


def check_magnitudes(box: Array, positions: Array, sizes: Array) -> None:
    """Refuse lengths that no computation in float64 can handle, before any begins.

    Args:
        box: (2, 2), rows are the lattice vectors.
        positions: (m, 2).
        sizes: (n,) lengths of the particles, positive.
    """
    width, height, tilt = float(box[0, 0]), float(box[1, 1]), abs(float(box[1, 0]))
    lengths = [width, height, float(sizes.min()), float(sizes.max())]
    if min(lengths) < 1 / LONGEST or max(lengths) > LONGEST:
        raise InputError(
            f"box {box.tolist()} and sizes from {sizes.min():.6g} to {sizes.max():.6g}: lengths must lie between "
            f"{1 / LONGEST:g} and {LONGEST:g}; choose another unit of length"
        )
    if max(width, height) > FLATTEST * min(width, height) or tilt > FLATTEST * width:
        raise InputError(f"box {box.tolist()} is flatter or more tilted than 1 : {FLATTEST:g}: check its numbers")
    far = np.abs(positions).max(axis=1)
    if far.max() > FARTHEST * max(width, height):
        k = int(far.argmax())
        raise InputError(
            f"positions[{k}] is {positions[k].tolist()}, more than {FARTHEST:g} boxes away: move it into the box"
        )
    filled = float(np.sum(sizes**2)) / (width * height)
    if filled > DENSEST:
        raise InputError(
            f"squared sizes sum up to {filled:.4g} times the area of box {box.tolist()}, more than {DENSEST:g}: "
            "check both"
        )


def check_box(box: Array) -> None:
    """Refuse lattice vectors (2, 2) of no area, and a first one that does not lie along x."""
    if box[0, 1] != 0:
        raise InputError(f"box[0, 1] is {box[0, 1]:.6g}: the first lattice vector must lie along x")
    if box[0, 0] <= 0 or box[1, 1] <= 0:
        raise InputError(f"box {box.tolist()} has no positive area: box[0, 0] and box[1, 1] must be positive")


UNITS = ("eps", "k")  # names of the strength that is 1, and of the parameter that holds it
ENSEMBLES = ("fixed-box", "shear-stabilized")
REMEDY_OF_NEGATIVE_G = "Use the ensemble 'shear-stabilized'"
NEGATIVE_G = f"< 0: the packing is unstable to shear at this box shape. {REMEDY_OF_NEGATIVE_G}"
CONTACT_FORMS = ("outline", "segment", "segment/smooth")  # data files hold their places: append only
LARGEST = 1e50  # of a parameter: energies and stiffnesses then stay far from the ends of float64


@dataclass(frozen=True)
class Parameter:
    """A parameter of a force law, declared once: what it may be, and what it is measured in.

    `jam`, `pack`, campaigns and the command line take those with a default by name; a packing that does not say one has
    the default.
    """

    energy: int = 0  # power of energy that it is measured in
    length: int = 0  # power of length
    default: Any = None  # None: every packing says it
    least: float = 1 / LARGEST
    largest: float = LARGEST
    may_vanish: bool = False
    choices: tuple[str, ...] = ()  # of a parameter that is a name; files of LAMMPS hold its place here
    each: bool = False  # one number for each particle
    over_size: bool = False  # a length over the mean size of the particles
    beyond: str = ""  # what happens beyond the largest value, in words

    def check(self, name: str, value: Any) -> None:
        """Refuse a value that is no number in range, or no name among the choices."""
        if self.choices:
            check_choice(f"{name} form", value, self.choices)
        elif not self.each and not (self.may_vanish and is_number(value) and value == 0):
            if not (is_number(value) and self.least <= as_plain(value) <= self.largest):
                units = "choose other units where it is beyond" if self.energy or self.length else ""
                more = "; ".join(filter(None, [f"beyond, {self.beyond}" if self.beyond else "", units]))
                raise InputError(
                    f"params[{name!r}] is {value!r}: must be a number from {self.least:g} to {self.largest:g}"
                    + (f"; {more}" if more else "")
                )


# A particle held by fewer forces that push is not in stable equilibrium: two balance only on one line. Boromand et al.
# say "less than 2", which leaves such disks in. The same number is `least` of lammps_inputs/in.sp.contacts, since
# analysis reads no deck; tests/engine/test_decks.py compares the two.
LEAST_CONTACTS = 3


class PairLaw(ABC):
    """What every law of a contact can be asked, so that nobody needs to ask which one it is."""

    least_contacts: ClassVar[int] = LEAST_CONTACTS  # that hold a particle
    least_bearing: ClassVar[int] = LEAST_CONTACTS  # with which a particle may bear load
    # eigenvalue of a Hessian over the largest element on its diagonal that is rounding: a mode below is floppy.
    # Translations, which cost nothing, come out at 1e-16 to 5e-17 of it (droplets at onset, N = 12 and 64)
    floppy: ClassVar[float] = 16 * float(np.finfo(float).eps)
    parameters: ClassVar[Mapping[str, Parameter]]  # beside the strength that the units name; declared here alone

    @abstractmethod
    def __call__(self, contact: Array, distance: Array) -> tuple[Array, Array, Array]:
        """Energy U, force U' and stiffness U'' of pairs within the cutoff.

        Args:
            contact: (m,) distance s at which two surfaces meet.
            distance: (m,) r.

        Returns:
            Three (m,) arrays: U, dU/dr, d2U/dr2.
        """

    @property
    def range(self) -> float:
        """How far beyond contact the law acts and pulls; 0 for pure repulsion, whose cutoff is the contact itself."""
        return 0.0

    @property
    def slack(self) -> float:
        """Force up to which a contact that a minimiser leaves bears nothing: a chain of such contacts is floppy."""
        return 0.0

    def drag_stiffness(self, contact: Array, distance: Array) -> Array:
        """(m,) stiffness in the drag coefficient of each contact, never negative."""
        return self(contact, distance)[2]

    @property
    def springs(self) -> bool:
        """Whether the force grows in proportion to the overlap."""
        return True

    def stiffness_at(self, pressure: float) -> float:
        """Typical stiffness of contacts over the strength at a pressure, lengths in the unit of length."""
        return 1.0

    def beside_springs(self, energy: float) -> float:
        """Typical contact force over the force of springs of the same strength, at a contact energy per disk."""
        return 1.0

    def lammps_variables(self) -> dict[str, object]:
        """Variables by which a deck knows the law."""
        return {}

    def kernel_arguments(self) -> tuple[float, int, float] | None:
        """What the compiled FIRE of disks takes; None where it does not know the law, and LAMMPS minimises alone."""
        return None

    @property
    def power_of_contact(self) -> float:
        """p of a strength ~ s^p that pair styles of LAMMPS scale where each disk has its own size."""
        return 0.0

    def root_energy(self, energy: float) -> float:
        """Contact energy, to the power that makes it grow as phi - phi_J above onset: sqrt(U) of springs."""
        return float(np.sqrt(energy))


def check_params(model: str, units: str, declared: Mapping[str, Parameter], params: Mapping[str, Any]) -> None:
    """Refuse force-law parameters that are missing, unknown by name, no positive numbers or out of range."""
    if units not in declared:
        raise InputError(f"model {model} has no units {units!r}")
    if unknown := params.keys() - declared.keys():
        raise InputError(f"params[{min(unknown)!r}]: the force law of model {model} in units {units} has no such name")
    for name, parameter in declared.items():
        if name in params:
            parameter.check(name, params[name])
        elif parameter.default is None:
            raise InputError(f"params of model {model} in units {units} lack {name!r}")
