"""Comparison of the carriers of a force law, the programs that evaluate it, with the analysis.

The analysis evaluates a law in numpy, LAMMPS by the deck and, for disks that repel, the minimiser in compiled code.
Each is compared once in a process, for each law with its numbers, in the first state that can tell: contact forces
exceed their rounding. A state without contacts proves nothing. One in which only some sizes meet, or in which disks
that also pull only push, proves a part: further states are compared.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import EngineError, InputError
from jamlab.laws.pair_law import check_derivatives
from jamlab.packing.derived import per_packing
from jamlab.packing.facts import law_of
from jamlab.packing.lammps_files import MOST_TYPES
from jamlab.packing.natural_units import natural_scales
from jamlab.packing.packing import Packing
from jamlab.registry import EXTENDING

SAME = 1e-9  # relative error of what agrees; 1e-12 and less is found
_DIGITS = 8 * float(np.finfo(float).eps)  # error of positions over the size of the box; 1 and less is found
_ROOM = 4.0  # for sums of errors, over their expected value
_PLACES = 8  # moved by rounding, at which forces of outlines are asked for where they seem to differ
_TELLS = 1e7  # largest force of contacts over what rounding does to one, from which on a state can tell

# commands that leave forces as they are
_HARMLESS = frozenset(
    "print thermo thermo_style thermo_modify dump undump dump_modify write_dump write_data write_restart variable "
    "compute uncompute compute_modify run timestep reset_timestep log info neighbor neigh_modify velocity group "
    "min_style min_modify minimize".split()
)

_NOTHING = 1e-22  # contact energy in natural units that is rounding
_STRONGER = 30.0  # contact energy over that of a state that could not tell, from which on the next is looked at

_MOST_PAIRS = 3  # of different sizes that have to meet, of one large and one small kind of particles all
_LOOKS = frozenset(8**k for k in range(12))  # the first state, the 8th, 64th ...: of those that hardly tell more
_EACH_SESSION = 4  # states in parts of which a law was compared; the next are looked at less and less often


@dataclass
class _Known:
    """What states have told of a carrier in this process."""

    agrees: bool = False  # in all that it can do
    seen: int = 0  # states, compared or not
    weak: float = 0.0  # contact energy of states that could not tell
    parts: set[Hashable] = field(default_factory=set)  # in which it agrees
    compared: int = 0  # states that told of parts


_known: dict[Hashable, _Known] = {}


def forget() -> None:
    """Compare all carriers again."""
    _known.clear()
    check_derivatives.cache_clear()


class Carried(NamedTuple):
    """Forces, energy and stress of a packing by a carrier."""

    forces: Array  # (len(positions), 2), 0 on fixed particles
    energy: float | None = None  # None: it does not say
    stress: Array | None = None  # (2, 2)


def key(carrier: str, packing: Packing, way: str = "") -> Hashable:
    """Name of a comparison that is made once. `way`: how the carrier evaluates the law, if it has several ways."""
    sizes = _sizes(packing)
    kinds = tuple(np.round(sizes / sizes[-1], 6)) if len(sizes) <= 2 else (len(sizes) > MOST_TYPES,)
    law = type(packing.law), packing.law, *law_of(packing).items()
    return (carrier, way, packing.model, packing.units, kinds, *law)


@per_packing
def _sizes(packing: Packing) -> Array:
    """Different sizes of particles, from small to large, flat walls not counted."""
    sizes = np.unique(packing.kind.type_sizes(packing))
    return sizes[sizes > 0]


def _parts(packing: Packing) -> tuple[set[Hashable], int]:
    """Parts of a law of which the contacts of a state tell, and how many there are: sizes that meet, and where disks
    also pull whether they push, pull more with the gap, or less."""
    sizes, pairs, reach = _sizes(packing), packing.kind.pairs(packing), packing.law.range
    number = np.searchsorted(sizes, packing.kind.type_sizes(packing) * (1 - 1e-12))
    some = np.sort(np.column_stack([number[pairs.i], number[pairs.j]]), axis=1)
    met = np.unique(some[:, 0] * len(sizes) + some[:, 1]) if len(some) else np.zeros(0)
    most = min(_MOST_PAIRS, len(sizes) * (len(sizes) + 1) // 2)
    found: set[Hashable] = {int(each) for each in met}
    if not reach:
        return found, most
    gap = packing.kind.contact_forces(packing).gap
    pulls = {"push": gap < 0, "near": (gap > 0) & (gap < 0.5 * reach), "far": (gap > 0.5 * reach) & (gap < reach)}
    if packing.kind.has_outlines:  # vertices of one pair lie at all gaps
        pulls = {"push": gap < 0, "pull": gap > 0}
    return found | {name for name, there in pulls.items() if there.any()}, most + len(pulls)


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
    reach, scales = float(np.abs(packing.box).sum()), natural_scales(packing)
    moved = _DIGITS * (reach + float(np.abs(packing.positions).max()))
    # at least that of one contact that rounding makes
    steepest = max([scales.stress, *(float(np.abs(term.hessian).max(initial=0.0)) for term in terms)])
    # errors of different terms are independent
    push, arm = (
        float(np.sqrt(sum((each**2).sum() for each in all_of)))
        for all_of in ([term.gradient for term in terms], [term.local for term in terms])
    )
    arm = float(np.hypot(arm, _ROOM * scales.length))  # there may be contacts that rounding makes
    shift = 0.0 if packing.law.deck_part else scales.energy  # of pair styles, from each energy
    contacts = [term.gradient for term in terms if term.name not in of_shape]
    if flat.any():
        contacts = [term.gradient[flat[term.sites].any(axis=1)] for term in terms if term.name not in of_shape]
    strongest = max((float(np.abs(each).max(initial=0.0)) for each in contacts), default=0.0)
    noise, size = moved * steepest + _DIGITS * strongest, len(packing.positions)
    sites = np.concatenate([term.sites.ravel() for term in terms])
    slopes = np.concatenate([term.gradient.reshape(-1, 2) for term in terms])
    own = np.column_stack([-np.bincount(sites, each, size) for each in slopes.T])
    works = np.concatenate([np.einsum("kma,kmb->kab", term.gradient, term.local) for term in terms])
    return _Own(
        forces=packing.frame.hold(own),
        energy=sum(float(term.energy.sum()) for term in terms),
        stress=np.asarray(-works.sum(axis=0) / packing.area),
        strongest=strongest,
        noise=noise,
        of_energy=SAME * sum(float(np.abs(term.energy).sum()) for term in terms)
        + _ROOM * moved * (push + noise * size)
        + _DIGITS * shift * sum(len(term.energy) for term in terms),
        of_stress=(SAME * float(np.abs(works).sum()) + _ROOM * noise * arm) / packing.area,
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
    if wrong and _jumps(packing, own, allowed):
        return False
    if wrong:
        raise EngineError(_difference(compared, packing, found, own))
    # balanced forces alone are those of any law that is as large everywhere
    tell = own.strongest if found.energy is not None else min(own.strongest, float(np.abs(own.forces).max()))
    return tell > _TELLS * own.noise


def _jumps(packing: Packing, own: _Own, allowed: float) -> bool:
    """Whether rounding of positions changes forces by more than is allowed: a vertex lies as near to two edges of one
    outline, and either may be the closest."""
    if not packing.kind.has_outlines:
        return False
    random = np.random.default_rng(1)
    moved = _DIGITS * (float(np.abs(packing.box).sum()) + float(np.abs(packing.positions).max()))
    for _ in range(_PLACES):
        step = moved * random.uniform(-1, 1, packing.positions.shape)
        there = _analysed(packing._trusted(positions=packing.positions + step))
        if there is None or float(np.abs(there.forces - own.forces).max()) > allowed:
            return True
    return False


class Comparison:
    """A carrier in a session, until a state has told that it agrees.

    Args:
        compared: `key` of the carrier.
    """

    def __init__(self, compared: Hashable) -> None:
        self._compared, self._open, self._fresh = compared, True, True

    def end(self) -> None:
        """End the comparison: LAMMPS has forces of the user's own."""
        self._open = False

    def see(self, contact_energy: float, carried: Callable[[], tuple[Packing, Carried] | None]) -> None:
        """Compare a state, unless its contacts are hardly stronger than those that could not tell; one in which LAMMPS
        finds no contact, or of a law of which parts were compared before, less and less often.

        Args:
            contact_energy: of the state, by LAMMPS.
            carried: gives the state and what the carrier evaluates of it; None where it cannot.

        Raises:
            EngineError: the carrier evaluates another law.
        """
        if not self._open:
            return
        known = _known.setdefault(self._compared, _Known())
        if known.agrees:
            self._open = False
            return
        if not self._wanted(known, abs(contact_energy)) or (given := carried()) is None:
            return
        self._fresh = False
        if not _compare(self._compared, *given):
            known.weak = max(known.weak, abs(contact_energy))
            return
        found, most = _parts(given[0])
        known.parts |= found
        known.compared += 1
        known.agrees = len(known.parts) >= most

    def _wanted(self, known: _Known, energy: float) -> bool:
        known.seen += 1
        seldom = known.seen in _LOOKS
        if not energy > _NOTHING:
            return seldom and bool(np.isfinite(energy))
        if known.parts:
            return seldom or (self._fresh and known.compared < _EACH_SESSION)
        return bool(np.isfinite(energy)) and energy > _STRONGER * known.weak


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
