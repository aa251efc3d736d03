"""Shear jamming: packings of repulsive particles below their jamming onset, which jam at some strain.

See Bertrand, Behringer, Chakraborty, O'Hern & Shattuck, Phys. Rev. E 93, 012901 (2016), and the review by Pan, Wang,
Yoshino, Zhang & Jin, Phys. Rep. 1038, 1 (2023).
"""

from __future__ import annotations

from dataclasses import dataclass, field

from jamlab.packing.packing import Packing
from jamlab.packing.result import Result


@dataclass(frozen=True)
class Bracket:
    """How closely the strain of jamming is bracketed."""

    width: float = 1e-3  # of it, over the step of strain


BRACKET = Bracket()


@dataclass(frozen=True)
class ShearJamming(Result):
    """Where shear jams a packing.

    Attributes:
        strain_below: strain of the last state that is unjammed.
        strain: strain of the first state that is jammed; the step between the two is at most a thousandth of
            `strain_step`.
        path: accumulated strain there, both directions added.
        pressure: of that state.
        packing: that state.
    """

    strain_below: float
    strain: float
    path: float
    pressure: float
    packing: Packing = field(repr=False)
