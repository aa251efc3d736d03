"""How many threads or MPI ranks a run may have."""

import os

import numpy as np

from jamlab.errors import InputError, named
from jamlab.packing.model import Model
from jamlab.packing.packing import Packing


def check_ranks(ranks: int, kind: Model[Packing] | None = None) -> None:
    """Refuse what is no number of threads or MPI ranks; `kind`: more than one, for particles that compiled
    code does not know."""
    most = max(os.cpu_count() or 1, 8)  # ranks that any machine may run, if slowly
    if isinstance(ranks, bool) or not isinstance(ranks, int | np.integer) or not 1 <= ranks <= most:
        raise InputError(f"{named('ranks', ranks)}: must be a whole number of processors of this machine, 1 to {most}")
    if ranks > 1 and kind is not None and not kind.compiled_fire:
        raise InputError(f"{named('ranks', ranks)}: {kind.particles} are minimised on one rank")
