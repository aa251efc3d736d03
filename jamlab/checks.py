"""What arguments must be: refused by name, value and remedy before any work begins."""

import sys
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jamlab.errors import InputError

MOST_PARTICLES = 1_000_000  # of a packing, which is made on one core: half a year until onset


def check_choice(name: str, value: object, choices: Iterable[str]) -> None:
    """Refuse a name that is not among the choices.

    Raises:
        InputError: naming the value and the choices.
    """
    known = tuple(choices)
    if not isinstance(value, str) or value not in known:
        raise InputError(f"unknown {name} {value!r}: use one of {', '.join(known)}")


def check_number(name: str, value: Any, highest: float) -> None:
    """Refuse what is no number above 0 and up to `highest`.

    Raises:
        InputError: naming the value.
    """
    if not is_number(value) or not 0 < value <= highest:
        raise InputError(f"{name} = {value!r}: must be a number above 0 and at most {highest:g}")


def check_bidisperse(n: Any, seed: Any, phi: float) -> None:
    """Refuse numbers that no half-small, half-large packing can start from.

    Raises:
        InputError: naming the value.
    """
    if isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 2 or n % 2:
        raise InputError(f"n = {n}: half of the particles are large, so n must be an even number, 2 or more")
    if n > MOST_PARTICLES:
        raise InputError(f"n = {n}: must be {MOST_PARTICLES} or less, a run takes one core half a year there")
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise InputError(f"seed = {seed}: must be a whole number, 0 or more")
    check_number("phi", phi, 2.0)


def is_number(value: object) -> bool:
    """Whether a value is a finite real number; a truth value is none."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        return False
    size: Any = abs(value)
    return bool(size <= sys.float_info.max)  # False too for an int that no float can hold


def finite_array(name: str, values: ArrayLike, shape: tuple[int | None, ...]) -> NDArray[np.float64]:
    """A float64 copy of `values`.

    Args:
        name: of the argument, for the message.
        values: numbers.
        shape: wanted; None stands for any length.

    Raises:
        InputError: what are no numbers, another shape, or values that are not finite.
    """
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{name} must hold numbers only, in rows of one length") from None
    if array.ndim != len(shape) or any(want not in (None, got) for want, got in zip(shape, array.shape, strict=True)):
        wanted = "(" + ", ".join("any" if size is None else str(size) for size in shape) + ")"
        raise InputError(f"{name} must have shape {wanted}, got {array.shape}")
    bad = np.argwhere(~np.isfinite(array))
    if len(bad):
        where = tuple(int(k) for k in bad[0])
        raise InputError(f"{name}{list(where)} is {array[where]}: all values must be finite numbers")
    return array


def check_positive(name: str, values: NDArray[np.float64]) -> None:
    """Refuse an array (n,) that holds a number that is not above 0.

    Raises:
        InputError: naming the first of them.
    """
    bad = np.flatnonzero(values <= 0)
    if len(bad):
        raise InputError(f"{name}[{bad[0]}] is {values[bad[0]]:.6g}: must be positive")
