"""Relax packings from elsewhere to the minimum next to them."""

from __future__ import annotations

import numpy as np

from jamlab.checks import checked
from jamlab.engine.session import Session
from jamlab.packing.natural_units import in_natural_units
from jamlab.packing.packing import Packing
from jamlab.packing.recipe import changed
from jamlab.protocols.saddles import record, relax_off_saddles


@checked
def relax(packing: Packing, force_tolerance: float | None = None) -> Packing:
    """Relax a packing to an energy minimum in its ensemble: with a fixed box, or to zero shear stress.

    Use it for packings with rounded coordinates, such as float32 of MDAnalysis, or from dynamics: z, moduli and G* are
    defined at a minimum.

    Args:
        packing: SP or DP.
        force_tolerance: largest force at the minimum, as in `jamlab.compress`.

    Returns:
        The minimum, with `rounding` 0; `converged` is False if the tolerance was not met. `provenance["moved"]` is the
        largest displacement.

    Raises:
        InputError: a tolerance out of range.
        EngineError: LAMMPS rejects the packing.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> moved = p.with_state(positions=p.positions + 1e-3 * np.sin(p.positions))
        >>> moved.converged
        False
        >>> back = jamlab.relax(moved)
        >>> back.converged, jamlab.evaluate(back).max_force < 1e-11
        (True, True)
    """
    found = _relaxed(packing, force_tolerance)
    moved = float(np.hypot(*(found.positions - packing.positions).T).max())
    found = found.with_state(rounding=0.0, provenance={"moved": moved})
    return changed(packing, found, "relax", force_tolerance=force_tolerance)


@in_natural_units()
def _relaxed(packing: Packing, tolerance: float | None) -> Packing:
    with Session(packing) as session:
        found = relax_off_saddles(session, tolerance)
        return record(session, session.packing(), found, precision="float64")
