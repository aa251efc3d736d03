"""How many threads or MPI ranks a run may have."""

import os

import numpy as np

from jamlab.errors import InputError

_FEW = 8  # ranks that any machine may run, if slowly


def check_ranks(ranks: int, one: bool = False) -> None:
    """Refuse what is no number of threads or MPI ranks; `one`: more than one, for droplets, which have one."""
    most = max(os.cpu_count() or 1, _FEW)
    if isinstance(ranks, bool) or not isinstance(ranks, int | np.integer) or not 1 <= ranks <= most:
        raise InputError(f"ranks = {ranks!r}: must be a whole number of processors of this machine, 1 to {most}")
    if ranks > 1 and one:
        raise InputError(f"ranks = {ranks}: polygons are minimised on one rank")
