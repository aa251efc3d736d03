"""Numbers of particles that a packing may be made of."""

from typing import Any

import numpy as np

from jamlab.arguments.table import argument
from jamlab.checks import check_number, check_seed, is_number
from jamlab.errors import InputError, named

MOST_PARTICLES = int(argument("n").ends()[1])


def check_bidisperse(n: Any, seed: Any, phi: float, large: Any = 0.5) -> None:
    """Refuse numbers that no packing of small and large particles can start from; large: number share of the large
    ones."""
    if not is_number(large) or not 0 < large < 1:
        raise InputError(
            f"{named('fraction_large', large)}: the number fraction of large particles must lie between 0 and 1"
        )
    check_count(n, large)
    if not 0 < round(large * n) < n:
        raise InputError(
            f"{named('fraction_large', large, 'g')}: "
            f"with n = {n} all particles have one size; use a value closer to 0.5"
        )
    check_seed(seed)
    check_number("phi", phi, 2.0)


def check_count(n: Any, large: float | None = 0.5) -> None:
    """Refuse a number of particles that no packing has; an odd one where half of them are large. None: of any sizes."""
    whole = isinstance(n, int | np.integer) and not isinstance(n, bool) and n >= 2
    if large == 0.5 and not (whole and n % 2 == 0):
        raise InputError(f"{named('n', n)}: half of the particles are large, so n must be an even number, 2 or more")
    if not whole:
        raise InputError(f"{named('n', n)}: must be a whole number of particles, 2 or more")
    if n > MOST_PARTICLES:
        raise InputError(f"{named('n', n)}: at most {MOST_PARTICLES} particles are supported")
