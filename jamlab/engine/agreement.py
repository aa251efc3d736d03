"""Comparison of the carriers of a force law, the programs that evaluate it, with the analysis.

The analysis evaluates a law in numpy, LAMMPS by the deck and, for disks that repel, the minimiser in compiled code.
Each is compared once in a process, for each law with its numbers, in the first state that can tell: contact forces
exceed their rounding. A state without contacts proves nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import NamedTuple

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import EngineError, InputError
from jamlab.packing.derived import per_packing
from jamlab.packing.facts import law_of
from jamlab.packing.natural_units import natural_scales
from jamlab.packing.packing import Packing
from jamlab.registry import EXTENDING

SAME = 1e-9  # relative error of what agrees; 1e-12 and less is found
_DIGITS = 64 * float(np.finfo(float).eps)  # error of positions over the size of the box, with room
_TELLS = 1e3  # largest force of contacts over what rounding does to one, from which on a state can tell

# commands that leave forces as they are
_HARMLESS = frozenset(
    "print thermo thermo_style thermo_modify dump undump dump_modify write_dump write_data write_restart variable "
    "compute uncompute compute_modify run timestep reset_timestep log info neighbor neigh_modify velocity group "
    "min_style min_modify minimize".split()
)

_NOTHING = 1e-22  # contact energy in natural units that is rounding
_STRONGER = 4.0  # contact energy over that of a state that could not tell, from which on the next is looked at

_agreed: set[Hashable] = set()


class Carried(NamedTuple):
    """Forces, energy and stress of a packing by a carrier."""

    forces: Array  # (len(positions), 2), 0 on fixed particles
    energy: float | None = None  # None: it does not say
    stress: Array | None = None  # (2, 2)


def key(carrier: str, packing: Packing, way: str = "") -> Hashable:
    """Name of a comparison that is made once. `way`: how the carrier evaluates the law, if it has several ways."""
    return (carrier, way, packing.model, packing.units, type(packing.law), packing.law, *law_of(packing).items())


class _Own(NamedTuple):
    """Forces, energy and stress of a packing by the analysis, and their rounding errors."""

    forces: Array
    energy: float
    stress: Array
    strongest: float  # force of a contact, or where there are flat walls of one with them
    noise: float  # of a force
    of_energy: float
    of_stress: float


@per_packing
def _analysed(packing: Packing) -> _Own | None:
    """Evaluate the energy terms; None if they are undefined, because outlines cross or centres coincide."""
    try:
        terms = packing.kind.terms(packing, True)
    except InputError:
        return None
    flat, of_shape = packing.frame.flat_sites, {term.name for term in packing.kind.shape_terms(packing)}
    reach = float(np.abs(packing.box).sum())
    moved = _DIGITS * (reach + float(np.abs(packing.positions).max()))
    # at least one contact that rounding makes
    steepest = max([natural_scales(packing).stress, *(float(np.abs(term.hessian).max(initial=0.0)) for term in terms)])
    pushes = sum(float(np.abs(term.gradient).sum()) for term in terms)
    contacts = [term.gradient for term in terms if term.name not in of_shape]
    if flat.any():
        contacts = [term.gradient[flat[term.sites].any(axis=1)] for term in terms if term.name not in of_shape]
    strongest = max((float(np.abs(each).max(initial=0.0)) for each in contacts), default=0.0)
    noise, size = moved * steepest + _DIGITS * strongest, len(packing.positions)
    sites = np.concatenate([term.sites.ravel() for term in terms])
    slopes = np.concatenate([term.gradient.reshape(-1, 2) for term in terms])
    own = np.column_stack([-np.bincount(sites, each, size) for each in slopes.T])
    work = np.sum([np.tensordot(term.gradient, term.local, ((0, 1), (0, 1))) for term in terms], axis=0)
    return _Own(
        forces=packing.frame.hold(own),
        energy=sum(float(term.energy.sum()) for term in terms),
        stress=np.asarray(-work / packing.area),
        strongest=strongest,
        noise=noise,
        of_energy=SAME * sum(float(np.abs(term.energy).sum()) for term in terms)
        + moved * (pushes + noise * size)
        + _DIGITS * natural_scales(packing).energy * sum(len(term.energy) for term in terms),  # of shifted pair styles
        of_stress=(SAME * pushes + noise * size) * reach / packing.area,
    )


def _compare(compared: Hashable, packing: Packing, found: Carried) -> bool:
    """Compare a carrier with the analysis for one packing, and return whether the state can tell.

    Args:
        compared: `key` of the carrier.
        packing: the state.
        found: of the carrier.

    Raises:
        EngineError: the carrier evaluates another law.
    """
    if (own := _analysed(packing)) is None:
        return False
    allowed = SAME * max(own.strongest, float(np.abs(own.forces).max())) + own.noise
    wrong = float(np.abs(found.forces - own.forces).max()) > allowed
    if found.energy is not None:
        wrong |= abs(found.energy - own.energy) > own.of_energy
    if found.stress is not None and packing.frame.all_free:
        wrong |= float(np.abs(found.stress - own.stress).max()) > own.of_stress
    if wrong:
        raise EngineError(_difference(compared, packing, found, own))
    # balanced forces alone are those of any law that is as large everywhere
    tell = own.strongest if found.energy is not None else min(own.strongest, float(np.abs(own.forces).max()))
    if tells := tell > _TELLS * own.noise:
        _agreed.add(compared)
    return tells


class Comparison:
    """A carrier in a session, until a state has told that it agrees.

    Args:
        compared: `key` of the carrier.
    """

    def __init__(self, compared: Hashable) -> None:
        self._compared, self._seen, self._open = compared, 0, True
        self._weak = 0.0  # contact energy of states that could not tell

    def end(self) -> None:
        """Compare no longer: LAMMPS has forces of the user's own."""
        self._open = False

    def see(self, contact_energy: float, carried: Callable[[], tuple[Packing, Carried] | None]) -> None:
        """Compare a state, unless its contacts are hardly stronger than those that could not tell; one in which LAMMPS
        finds no contact, less and less often.

        Args:
            contact_energy: of the state, by LAMMPS.
            carried: gives the state and what the carrier evaluates of it; None where it cannot.

        Raises:
            EngineError: the carrier evaluates another law.
        """
        if self._open and self._compared in _agreed:
            self._open = False
        if not self._open:
            return
        self._seen += 1
        energy = abs(contact_energy)
        if energy > _NOTHING:
            wanted = energy > _STRONGER * self._weak
        else:  # at the first, second, fourth ... state
            wanted = self._seen & (self._seen - 1) == 0
        if wanted and np.isfinite(energy) and (given := carried()) is not None:
            self._open = not _compare(self._compared, *given)
            self._weak = max(self._weak, energy)


def changes_forces(line: str) -> bool:
    """Whether a command of LAMMPS may change forces."""
    words = line.split(maxsplit=1)
    return bool(words) and words[0] not in _HARMLESS


def _difference(compared: Hashable, packing: Packing, found: Carried, own: _Own) -> str:
    carrier, way = compared[:2]  # type: ignore[index]
    figures = [("largest force", np.hypot(*found.forces.T).max(), np.hypot(*own.forces.T).max())]
    if found.energy is not None:
        figures.append(("energy", found.energy, own.energy))
    if found.stress is not None:
        figures.append(("pressure", 0.5 * np.trace(found.stress), 0.5 * np.trace(own.stress)))
    if found.forces.size and np.isclose(figures[0][1], figures[0][2], rtol=1e-6):
        figures.append(("largest difference of forces", np.abs(found.forces - own.forces).max(), 0.0))
    said = ", ".join(f"{name} {there:.9g} for {here:.9g}" for name, there, here in figures)
    return (
        f"{packing.law} of model {packing.model}: the {carrier}{way and f' ({way})'} evaluates another law than the "
        f"analysis: {said}; correct one of the two, see {EXTENDING}"
    )
