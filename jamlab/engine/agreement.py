"""Whether those who evaluate a force law, its carriers, agree with the law of the analysis.

A law stands in numpy, of which analysis is made, in a deck of LAMMPS and, for disks that repel, in compiled code. Each
is compared once a process, for each law with its numbers, in the first state that can tell: contacts push or pull more
than rounding does. A state without contacts proves nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import NamedTuple

import numpy as np

from jamlab.arrays import Array
from jamlab.engine.evaluation import Evaluation
from jamlab.errors import EngineError, InputError
from jamlab.laws.pair_law import HELP
from jamlab.packing.facts import law_of
from jamlab.packing.packing import Packing

SAME = 1e-9  # relative error of what agrees; 1e-12 and less is found
_DIGITS = 64 * float(np.finfo(float).eps)  # error of positions over the size of the box, with room
_TELLS = 1e3  # largest force of contacts over what rounding does to one, from which on a state can tell

# commands that leave forces as they are
_HARMLESS = frozenset(
    "print thermo thermo_style thermo_modify dump undump dump_modify write_dump write_data write_restart variable "
    "compute uncompute compute_modify run timestep reset_timestep log info neighbor neigh_modify velocity group "
    "min_style min_modify minimize".split()
)

_agreed: set[Hashable] = set()


class Carried(NamedTuple):
    """What a carrier evaluates of a packing."""

    forces: Array  # (len(positions), 2), 0 on fixed particles
    energy: float | None = None  # None: it does not say
    stress: Array | None = None  # (2, 2)


def key(carrier: str, packing: Packing, way: str = "") -> Hashable:
    """What is compared once. `way`: how the carrier evaluates the law, where it has several."""
    return (carrier, way, packing.model, packing.units, type(packing.law), packing.law, *law_of(packing).items())


def agreed(compared: Hashable) -> bool:
    """Whether a carrier has been compared."""
    return compared in _agreed


def compare(compared: Hashable, packing: Packing, found: Carried) -> bool:
    """Compare what a carrier evaluates of a packing with the law of the analysis; whether the state can tell.

    Args:
        compared: `key` of the carrier.
        packing: the state.
        found: of the carrier.

    Raises:
        EngineError: the carrier evaluates another law.
    """
    try:
        terms = packing.kind.terms(packing, True)
    except InputError:  # outlines cross, or centres coincide: analysis does not say
        return False
    size, moved = len(packing.positions), _DIGITS * float(np.abs(packing.box).sum() + np.ptp(packing.positions))
    of_shape = {term.name for term in packing.kind.shape_terms(packing)}
    own, energy, sizes, pushes = np.zeros((size, 2)), 0.0, 0.0, 0.0
    stress, steepest, strongest = np.zeros((2, 2)), 0.0, 0.0
    flat, on_flat = packing.frame.flat_sites, 0.0
    for term in terms:
        np.add.at(own, term.sites, -term.gradient)
        energy, sizes = energy + float(term.energy.sum()), sizes + float(np.abs(term.energy).sum())
        pushes += float(np.abs(term.gradient).sum())
        stress -= np.einsum("kai,kal->il", term.gradient, term.local) / packing.area
        steepest = max(steepest, float(np.abs(term.hessian).max(initial=0.0)))
        if term.name not in of_shape:
            strongest = max(strongest, float(np.abs(term.gradient).max(initial=0.0)))
            on_flat = max(on_flat, float(np.abs(term.gradient[flat[term.sites].any(axis=1)]).max(initial=0.0)))
    own = packing.frame.hold(own)
    noise = moved * steepest + _DIGITS * strongest
    largest = max(strongest, float(np.abs(own).max()))
    wrong = float(np.abs(found.forces - own).max()) > SAME * largest + noise
    if found.energy is not None:
        wrong |= abs(found.energy - energy) > SAME * sizes + moved * (pushes + moved * steepest * size)
    if found.stress is not None and packing.frame.all_free:
        reach = float(np.abs(packing.box).sum())
        wrong |= float(np.abs(found.stress - stress).max()) > (SAME * pushes + noise * size) * reach / packing.area
    if wrong:
        raise EngineError(_difference(compared, packing, found, Carried(own, energy, stress)))
    if tells := min(strongest, on_flat if flat.any() else strongest) > _TELLS * noise:
        _agreed.add(compared)
    return tells


class Comparison:
    """The deck of a session, until a state has told that it agrees.

    Args:
        compared: `key` of the deck.
    """

    def __init__(self, compared: Hashable) -> None:
        self._compared, self._seen, self._open = compared, 0, True

    def end(self) -> None:
        """Compare no longer: LAMMPS has forces of the user's own."""
        self._open = False

    def see(self, found: Evaluation, state: Callable[[], Packing]) -> None:
        """Compare a state; one in which LAMMPS finds no contact, less and less often.

        Raises:
            EngineError: the deck evaluates another law.
        """
        if not self._open:
            return
        self._seen += 1
        if agreed(self._compared):
            self._open = False
        elif (found.contact_energy or self._seen & (self._seen - 1) == 0) and np.isfinite(found.energy):
            self._open = not compare(self._compared, state(), Carried(found.forces, found.energy, found.stress))


def changes_forces(line: str) -> bool:
    """Whether a command of LAMMPS may change forces."""
    words = line.split(maxsplit=1)
    return bool(words) and words[0] not in _HARMLESS


def _difference(compared: Hashable, packing: Packing, found: Carried, own: Carried) -> str:
    carrier, way = compared[:2]  # type: ignore[index]
    figures = [("largest force", np.hypot(*found.forces.T).max(), np.hypot(*own.forces.T).max())]
    if found.energy is not None and own.energy is not None:
        figures.append(("energy", found.energy, own.energy))
    if found.stress is not None and own.stress is not None:
        figures.append(("pressure", 0.5 * np.trace(found.stress), 0.5 * np.trace(own.stress)))
    if found.forces.size and np.isclose(figures[0][1], figures[0][2], rtol=1e-6):
        figures.append(("largest difference of forces", np.abs(found.forces - own.forces).max(), 0.0))
    said = ", ".join(f"{name} {there:.9g} for {here:.9g}" for name, there, here in figures)
    return (
        f"{packing.law} of model {packing.model}: the {carrier}{way and f' ({way})'} evaluates another law than the "
        f"analysis: {said}; correct one of the two, see {HELP}"
    )
