"""Units in which LAMMPS takes packings."""

from jamlab.errors import InputError
from jamlab.packing.natural_units import natural_scales
from jamlab.packing.packing import Packing

FROM_ONE = 4.0  # factor by which natural units of a packing may differ from its own


def check_fits(packing: Packing) -> None:
    """Refuse units that are far from the natural ones of a packing, and what its model has against LAMMPS."""
    scales = natural_scales(packing)
    most = {scales.length: FROM_ONE, scales.stress: FROM_ONE * max(1.0, packing.law.stiffness)}
    if not all(1 / FROM_ONE <= unit <= highest for unit, highest in most.items()):
        raise InputError(
            f"the natural units of the packing are {scales.length:.3g} of its unit of length and "
            f"{scales.stress:.3g} of its unit of stress, too far from 1 for LAMMPS; give "
            "`natural_scales(packing).to_natural(packing)` of jamlab.packing.natural_units"
        )
    packing.kind.check_for_lammps(packing)
