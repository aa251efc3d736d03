"""FIRE over soft disks in compiled code: the steps of LAMMPS' `min_style fire`, at less than half its price.

A step of LAMMPS serves any force field in three dimensions; one of `plugin/kernels/disk_fire.cpp` knows only disks that
repel by `jamlab.laws.power.PowerLaw`, and its threads share memory. The states are the same to rounding, unless
a disk has more than twice the mean diameter: its mass then grows with it. Forces, energy and stress of the last state
are always LAMMPS' own.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.engine.agreement import SAME
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import EngineError
from jamlab.kernels.library import INTEGER, REAL, REALS, kernel
from jamlab.packing.box_strains import BoxStrains
from jamlab.packing.packing import Packing


def fire_numbers(*, lively: bool = False, slower: float = 1.0) -> Array:
    """Numbers of the method, (8,) in the order of the kernel.

    Args:
        lively: less friction and longer steps, for disks whose box is free: they converge by slow slides of many at
            once, at contact forces that hardly push. A `tmax` of 7 is too long: contacts shake, and the box stays where
            it is.
        slower: factor on all time steps, for contacts that are soft.
    """
    given = defaults("minimizers")
    timestep, tmax, dmax = (float(given[name]) for name in ("timestep", "tmax", "dmax"))
    tmax, alpha0 = (6.0, 0.05) if lively else (tmax, 0.25)
    # longest move of a coordinate, mean diameters; the others are LAMMPS' defaults: shortest time step over the first,
    # factors of the time step, how much the velocity is turned towards the force, and its factor
    return np.array([timestep * slower, tmax, dmax, 0.02, 1.1, 0.5, alpha0, 0.99])


@dataclass(frozen=True)
class Fire:
    """FIRE of disks in the compiled loop."""

    delay: int = 20  # steps downhill after which the time step grows
    most_uphill: int = 2000  # steps uphill on end after which it gives up
    skin: float = 0.2  # first extra reach of the neighbor list, mean diameter; the kernel adapts it


FIRE = Fire()


_BOX_TOO_SMALL, _NOT_FINITE = -1, -2

_HEAVY = 2.0  # mean diameters, beyond which the mass of a disk in the kernel grows with it

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
    box_strains: BoxStrains | None = None,
    fire: Array | None = None,
    stretch: int | None = None,
) -> tuple[Packing, int, float] | None:
    """Minimise the energy of disks, or their enthalpy where the box is free to strain. A strain e of the box is a
    coordinate like the positions, of the inertia of all n of them: q = sqrt(n) d e. `force`: tolerance on the
    largest norm of a force, and on unbalanced stress times mean diameter; `threads`: pay from about 10 000 disks, and
    change no digit; `box_strains`: that the box may take; `fire`: of `fire_numbers`; `stretch`: steps after which it
    starts anew. Returns the packing, the steps taken, and the residual force; None if the box is so small (three
    times the largest disk) that two disks may meet in two images, which the kernel does not count, or if it does not
    know the law."""
    law = packing.law.kernel_arguments()
    if law is None:
        return None
    strains = np.zeros((0, 2, 2)) if box_strains is None else box_strains.strains
    numbers, total, largest = fire_numbers() if fire is None else fire, 0, np.zeros(1)
    for _ in range(0, steps, stretch or steps):
        positions, box = packing.positions.copy(), packing.box[[0, 1, 1], [0, 0, 1]]
        taken = _fire_disks(
            *(packing.n, positions, packing.disk_diameters, box, *law),
            *(force, stretch or steps, threads, FIRE.skin, numbers, FIRE.delay, FIRE.most_uphill, len(strains)),
            *(strains[:, [0, 0, 1], [0, 1, 1]].copy(), box_strains.pressure if box_strains else 0.0, largest),
        )
        if taken == _BOX_TOO_SMALL:
            return None
        if taken < 0:
            reason = "positions are not finite" if taken == _NOT_FINITE else "no threads could be started"
            raise EngineError(f"FIRE of {packing.n} disks stopped: {reason}")
        moved: dict[str, Any] = {"positions": positions}
        if len(strains):
            # many small shears must not add up to a change of area
            height = box[2] if np.einsum("aii->a", strains).any() else packing.area / box[0]
            moved["box"] = np.array([[box[0], 0.0], [box[1], height]])
        packing, total = packing._trusted(**moved), total + taken
        if largest[0] < force:
            break
    return packing, total, float(largest[0])


def fire_forces(packing: Packing) -> Array | None:
    """(n, 2) forces of the kernel, by which its first step from rest moves disks; None where it does not know the law,
    or the box is too small."""
    # one step from rest that moves each disk by its force: no longest move, a time step of 1
    one_step = np.array([1.0, 1.0, 1e300, 1.0, 1.0, 1.0, 0.0, 1.0])
    found = fire_disks(packing, 0.0, 1, fire=one_step)
    if found is None:
        return None
    heavy = packing.disk_diameters / (_HEAVY * packing.disk_diameters.mean())
    return np.asarray((found[0].positions - packing.positions) * np.maximum(heavy, 1.0)[:, None])


def kernel_has(packing: Packing, forces: Array) -> bool:
    """Whether the kernel finds these forces (n, 2), which show its law: at least one is not 0."""
    found = fire_forces(packing)
    return found is not None and bool(forces.any()) and bool(np.abs(found - forces).max() < SAME * np.abs(forces).max())
