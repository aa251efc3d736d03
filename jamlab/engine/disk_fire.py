"""FIRE over soft disks in compiled code: the steps of LAMMPS' `min_style fire`, at less than half its price.

A step of LAMMPS serves any force field in three dimensions; one of `plugin/kernels/disk_fire.cpp` knows only disks that
repel by `jamlab.models.pair_laws.PowerLaw`, and its threads share memory. The states are the same to rounding, unless
a disk has more than twice the mean diameter: its mass then grows with it. Forces, energy and stress of the last state
are always LAMMPS' own.
"""

from dataclasses import astuple, dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from jamlab.engine.box_border import BoxStrains
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import EngineError
from jamlab.kernels.library import INTEGER, REAL, REALS, kernel
from jamlab.packing.packing import Packing


@dataclass(frozen=True)
class FireSettings:
    """Numbers of the method, in the order of the kernel; those without a value stand in `lammps_inputs/parts/minimum`.

    Attributes:
        timestep: at first.
        tmax: longest time step over the first.
        dmax: longest move of a coordinate in one step, mean diameter.
        tmin: shortest time step over the first.
        dtgrow, dtshrink: factors of the time step.
        alpha0, alphashrink: how much the velocity is turned towards the force: at first, and its factor.
    """

    timestep: float
    tmax: float
    dmax: float
    tmin: float = 0.02  # from here on LAMMPS' defaults
    dtgrow: float = 1.1
    dtshrink: float = 0.5
    alpha0: float = 0.25
    alphashrink: float = 0.99


@cache
def fire_settings() -> FireSettings:
    """The numbers that decks use as well."""
    return FireSettings(**{name: float(defaults("minimizers")[name]) for name in ("timestep", "tmax", "dmax")})


@cache
def lively_fire() -> FireSettings:
    """Less friction and longer steps, for disks whose box is free: they come to rest by slow slides of many at once, at
    contact forces that hardly push. `tmax` = 7 is too long: contacts shake, and the box stays where it is."""
    return replace(fire_settings(), tmax=6.0, alpha0=0.05)


DELAY = 20  # steps downhill after which the time step grows
MOST_UPHILL = 2000  # steps uphill on end after which it gives up
SKIN = 0.2  # first extra reach of the neighbor list, mean diameter; the kernel adapts it

_BOX_TOO_SMALL, _NOT_FINITE = -1, -2

_fire_disks = kernel(
    "fire_disks",
    *(INTEGER, REALS, REALS, REALS, REAL, INTEGER, REAL, REAL, INTEGER, INTEGER, REAL, REALS, INTEGER, INTEGER),
    *(INTEGER, REALS, REAL, REALS),
)


def fire_disks(
    packing: Packing,
    force: float,
    steps: int,
    threads: int = 1,
    border: BoxStrains | None = None,
    fire: FireSettings | None = None,
) -> tuple[Packing, int, float] | None:
    """Minimise the energy of disks, or their enthalpy where the box is free to strain.

    A strain e of the box is a coordinate like those of the disks, of the inertia of all n of them: q = sqrt(n) d e.

    Args:
        packing: SP.
        force: tolerance on the largest norm of a force, and on unbalanced stress times mean diameter.
        steps: at most.
        threads: that share the work; pays from about 10 000 disks. Their number changes no digit.
        border: strains that the box may take; by default none.
        fire: numbers of the method, default `fire_settings`.

    Returns:
        The packing, the steps taken, and the largest force left. None if the box is so small (three times the largest
        disk) that two disks may meet in two images, which the kernel does not count, or if it does not know the law.

    Raises:
        EngineError: positions are not finite, or no threads can be started.
        MemoryError: out of memory.
    """
    law = packing.law.kernel_arguments()
    if law is None:
        return None
    positions, largest = packing.positions.copy(), np.zeros(1)
    box = packing.box[[0, 1, 1], [0, 0, 1]]
    strains = np.zeros((0, 2, 2)) if border is None else border.strains
    taken = _fire_disks(
        *(packing.n, positions, packing.disk_diameters, box, *law),
        *(force, steps, threads, SKIN),
        *(np.array(astuple(fire or fire_settings())), DELAY, MOST_UPHILL, len(strains)),
        *(strains[:, [0, 0, 1], [0, 1, 1]].copy(), border.pressure if border else 0.0, largest),
    )
    if taken == _BOX_TOO_SMALL:
        return None
    if taken < 0:
        reason = "positions are not finite" if taken == _NOT_FINITE else "no threads could be started"
        raise EngineError(f"FIRE over {packing.n} disks stopped: {reason}")
    moved: dict[str, Any] = {"positions": positions}
    if len(strains):
        # many small shears must not add up to a change of area
        height = box[2] if np.einsum("aii->a", strains).any() else packing.area / box[0]
        moved["box"] = np.array([[box[0], 0.0], [box[1], height]])
    return packing._trusted(**moved), taken, float(largest[0])


def minimize_disks(
    packing: Packing,
    force: float,
    steps: int,
    stretch: int,
    threads: int,
    border: BoxStrains | None,
    fire: FireSettings | None,
) -> tuple[Packing, int] | None:
    """`fire_disks` that restarts after a stretch of steps, until the largest force is below `force`. Returns the
    packing and the steps taken; None where the kernel cannot take it."""
    total = 0
    for _ in range(0, steps, stretch):
        found = fire_disks(packing, force, stretch, threads, border, fire)
        if found is None:
            return None
        packing, taken, largest = found
        total += taken
        if largest < force:
            break
    return packing, total
