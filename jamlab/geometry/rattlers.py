"""Rattlers: particles that too few contacts hold in place, found recursively."""

import numpy as np
from numpy.typing import NDArray

# A particle held by fewer forces than this is not in stable equilibrium: two forces balance only on one line. Boromand
# et al. say "less than 2", which leaves such disks in. The same number is `least` of lammps_inputs/in.sp.contacts,
# written again because analysis reads no deck; tests/engine/test_decks.py compares the two.
LEAST_CONTACTS = 3


def find_rattlers(
    pairs: NDArray[np.int64], suspects: NDArray[np.bool_], least: int = LEAST_CONTACTS
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Remove particles with fewer than three contacts, again and again, until all others have three or more.

    Args:
        pairs: (m, 2) particles that touch.
        suspects: (n,) particles that may rattle; the others count as held.
        least: contacts of a particle that is held.

    Returns:
        (n,) rattlers, and (m,) contacts that bear force, those between two particles that do not rattle.
    """
    rattlers = np.zeros(len(suspects), dtype=bool)
    while True:
        bearing = ~rattlers[pairs].any(axis=1)
        degree = np.bincount(pairs[bearing].ravel(), minlength=len(suspects))
        loose = (degree < least) & suspects & ~rattlers
        if not loose.any():
            return rattlers, np.asarray(bearing)
        rattlers |= loose
