"""Athermal quasi-static shear: a small affine strain, a minimum, and again; the limit of flow at small rates."""

from jamlab.errors import InputError
from jamlab.flow.flow_run import Progress
from jamlab.flow.shear_run import ShearRun
from jamlab.packing.packing import Packing


def quasistatic_shear(
    packing: Packing, strain: float, step: float, frames: float | None = None, progress: Progress | None = None
) -> ShearRun:
    """Shear along x of the box in steps, each to an energy minimum; `shear` calls this for rate 0.

    Args:
        packing: SP or DP at a minimum.
        strain: at the end.
        step: of strain between two minima.
        frames: strain between two packings that are kept, by default the first and the last only.
        progress: called after each minimum.

    Raises:
        InputError: a value out of range.
    """
    raise InputError("rate = 0: quasi-static shear comes in a later version; give a small rate, such as 1e-5")
