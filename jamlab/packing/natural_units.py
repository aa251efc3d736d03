"""Express packings in natural units, in which sizes and stiffnesses are of order one, and back.

Tolerances, time steps and trust radii of solvers are numbers of order one in these units, so they mean the same for a
packing in any others. The units are powers of two: a packing changes by no digit on the way there and back, and one
whose mean diameter and stiffness are near one, as the papers have them, is left as it is.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np

from jamlab.laws.pair_law import PairLaw
from jamlab.packing.magnitudes import ROUNDING
from jamlab.packing.packing import Packing
from jamlab.packing.quantities import NUMBER
from jamlab.type_variables import P, R


@dataclass(frozen=True)
class Scales:
    """Natural units of a packing, in its own units.

    Example:
        >>> from jamlab.packing.natural_units import natural_scales
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> soft = p.with_state(positions=3e-6 * p.positions, box=3e-6 * p.box, diameters=3e-6 * p.disk_diameters)
        >>> scales = natural_scales(soft.with_state(params={"k": 1e-7}))
        >>> bool(0.7 < 3e-6 / scales.length < 1.5), bool(0.7 < 1e-7 / scales.stress < 1.5)
        (True, True)
    """

    length: float = 1.0  # power of two next to the mean diameter; DP: to the mean of sqrt(a0)
    energy: float = 1.0  # power of two next to eps, or to k length^2, times the stiffness of the law

    @property
    def force(self) -> float:
        """Energy over length."""
        return self.energy / self.length

    @property
    def stress(self) -> float:
        """Energy over area; stiffness of a contact as well."""
        return self.energy / self.length**2

    def unit(self, dimension: tuple[int, int]) -> float:
        """Natural unit of a quantity; `dimension`: its powers of energy and length."""
        return self.energy ** dimension[0] * self.length ** dimension[1]

    @property
    def inverse(self) -> Scales:
        """The units of the packing, in natural ones."""
        return Scales(1 / self.length, 1 / self.energy)

    def to_natural(self, packing: Packing) -> Packing:
        """The same packing in natural units."""
        return _in_units(packing, self.inverse)

    def from_natural(self, packing: Packing) -> Packing:
        """The packing, given in natural units, in those that the scales are measured in."""
        return _in_units(packing, self)


def mean_size(packing: Packing) -> float:
    """Mean diameter of disks, or mean square root of the rest areas of droplets: 1 in packings that jamlab makes."""
    return float(np.mean(packing.frame.sizes))


def stiffness_scale(packing: Packing) -> float:
    """Stiffness k, or eps over the square of the mean size of particles: of contacts and in drag coefficients."""
    strength, power = _strength(packing)
    return strength / mean_size(packing) ** (2 + power)


def _strength(packing: Packing) -> tuple[float, int]:
    """The parameter that the units name, and the power of length that it is measured in."""
    return float(packing.params[packing.units]), packing.parameters[packing.units].length


def natural_scales(packing: Packing) -> Scales:
    """Scales of a packing, of any model, in any units."""
    length, (strength, power) = _power_of_two(mean_size(packing)), _strength(packing)
    return Scales(length, _power_of_two(strength * packing.law.stiffness) * length**-power)


def natural_stress(law: PairLaw) -> float:
    """Natural unit of stress of a packing with this law and particles of mean size 1."""
    return _power_of_two(law.strength * law.stiffness)


def unit_scales(packing: Packing) -> Scales:
    """Units in which the mean size of particles is 1, and so is the stiffness: exactly, at the cost of a digit.

    Drag laws with a power below 1 and the background know no other length; searches and flows compare energies, steps
    and forces with numbers, and take one path in all units.
    """
    length = mean_size(packing)
    if abs(length - 1.0) < ROUNDING:
        length = 1.0
    strength, power = _strength(packing)
    return Scales(length, strength * packing.law.stiffness * length**-power)


def in_natural_units(
    gives: tuple[int, int] = NUMBER,
    units: Callable[[Packing], Scales] = natural_scales,
    **takes: tuple[int, int],
) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Let a function of a packing compute in natural units, whatever units the packing has: the one door at which units
    change. Packings among its arguments and results are converted, and classes of results by their `dimensions`, powers
    of energy and length by the name of a field.

    Args:
        gives: powers of energy and length of the numbers that it returns.
        units: natural units of a packing.
        takes: powers of energy and length of its arguments, by name.
    """

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        signature = inspect.signature(function)

        @functools.wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> R:
            given = signature.bind(*args, **kwargs)
            scales = units(cast("Packing", next(iter(given.arguments.values()))))
            if scales == Scales():
                return function(*args, **kwargs)
            for name, value in given.arguments.items():
                given.arguments[name] = _converted(value, scales.inverse, takes.get(name, NUMBER))
            found = function(*given.args, **given.kwargs)
            return cast("R", _converted(found, scales, gives))

        return call

    return decorate


def _converted(value: Any, scales: Scales, dimension: tuple[int, int]) -> Any:
    """What stands in natural units in others, or the other way round."""
    if isinstance(value, Packing):
        return _in_units(value, scales)
    if isinstance(value, Iterator):
        return (_converted(each, scales, dimension) for each in value)
    if isinstance(value, list | tuple):
        return type(value)(_converted(each, scales, dimension) for each in value)
    if fields := getattr(value, "dimensions", None):
        return replace(value, **{name: getattr(value, name) * scales.unit(power) for name, power in fields.items()})
    return value if dimension == NUMBER or value is None else value * scales.unit(dimension)


def _power_of_two(value: float) -> float:
    return float(2.0 ** round(np.log2(value)))


def _in_units(packing: Packing, scales: Scales) -> Packing:
    """The packing with all lengths and energies multiplied by the scales."""
    if scales == Scales():
        return packing

    def convert(name: str, value: Any) -> Any:
        power = packing.parameters[name]
        return value if power.choices else value * scales.unit((power.energy, power.length))

    units = dict.fromkeys(("box", "positions", "diameters", "rounding"), scales.length)
    units |= dict.fromkeys(("max_force", "force_tolerance"), scales.force)
    return packing._trusted(
        params={name: convert(name, value) for name, value in packing.params.items()},
        **{name: value * unit for name, unit in units.items() if (value := getattr(packing, name)) is not None},
        converged=packing.converged,
        on_rattlers=packing.on_rattlers,
        on_target=packing.on_target,
    )
