"""Comparison of the plugin with the analysis: elastic energy, shear stress and dissipated power of one state in flow.

The plugin holds force laws and drag laws of its own, in C++, and is told which by words. The energy of a flow
also balances under a wrong law. Therefore the first state of a flow that has contacts is evaluated on both
sides, once a process for the same words and laws.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import NamedTuple

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import EngineError
from jamlab.mechanics.stiffness import energy_terms, stress, stress_of
from jamlab.packing.natural_units import mean_size
from jamlab.packing.packing import Packing
from jamlab.registry import EXTENDING
from jamlab.rheology.damping import StokesDrag
from jamlab.rheology.drag_law import DragLaw, slips

_DIGITS = 1e-8  # to which both sides agree, but for the following
_ROUNDING = 1e-14  # of distances: over the mean overlap, the part of a force that is rounding
# thin contacts of disks that stiffen drag as at a least overlap, see LAYER in plugin/disk_flow.cpp; and what moves
# least drags as if it moved a little, where drag is a power of the velocity
_THIN, _OF_THIN, _OF_POWERS = 4e-3, 1e-2, 1e-6
_EACH_MARGINAL = 20.0  # for each pair whose gap does not tell whether it touches, of all contacts
_OF_MOVED = 1.0  # of the drag at contacts, where places were corrected since: 0.3 in creep of droplets without sliding
_CORRECTED = 5e-3  # by how much places are corrected, at most: FARTHEST in plugin/droplet_flow.cpp
_STILL = 1e-14  # rates in natural units that rounding of forces makes
_LOOSEST = 0.3  # part to which both sides agree, at most
_NOISE = 1e-13  # of velocities, whose differences at contacts may be small beside them: rounding, with room
_OF_SPINS = 1e-5  # of the power: errors of the spins, which the tolerance of the solver leaves
_STEP = 1e-2  # of the fastest rate, by which spins are changed
_EDGE = 1e-12  # of a distance of contact: pairs so near to it may count on one side alone
_TELLING = 1e-10  # of the dissipated power, which the drag on particles beside the flow must have to be compared
_SUMS = 1e-13  # of the dissipated power of velocities that do not cancel: rounding of its sum
_RIGID = 1e-8  # of the same: below, particles move as one piece, and rounding is seen
_agreed: set[Hashable] = set()


class Evaluated(NamedTuple):
    """What the plugin says of a state, in natural units; energy, stress and dissipation are per area."""

    energy: float
    elastic_stress: float
    dissipation: float
    rate: float
    marginal: float  # pairs of disks of which the gap does not tell whether they touch, and which may drag in part
    velocities: Array  # (sites, 3) beside the affine flow, and spins
    moved: bool  # whether places were corrected after the drag was summed


def agrees(key: Hashable) -> bool:
    """Whether these words and laws were found to agree before."""
    return key in _agreed


def forget_flows() -> None:
    """Compare all words and laws again."""
    _agreed.clear()


def compare(key: Hashable, packing: Packing, law: DragLaw, background: float, found: Evaluated) -> bool:
    """Compare the plugin with the analysis for one state, and return whether the state can tell: one without
    contacts, or with two disks on the point of touching, or in which all particles follow the flow or roll does not.

    Raises:
        EngineError: the two differ.
    """
    terms, size = energy_terms(packing), mean_size(packing)
    overlap = packing.law.range - packing.kind.contact_forces(packing).gap
    if not len(overlap):
        return False
    loose = _DIGITS + _ROUNDING * size / float(overlap.mean()) + _EACH_MARGINAL * found.marginal / len(overlap)
    if loose > _LOOSEST:
        return False
    who = f"the force law of {packing.kind.particles}, {packing.law},"
    energies = np.concatenate([term.energy for term in terms]) / packing.area
    _check("elastic energy per area", found.energy, float(energies.sum()), loose * float(np.abs(energies).sum()), who)
    largest = sum(float(np.abs(stress_of([term], packing.area)).max()) for term in terms)
    _check("elastic shear stress", found.elastic_stress, -float(stress(packing)[0, 1]), loose * largest, who)
    if overlap.min() < _EDGE * size:
        return False
    if (thin := _share_of_thin(packing, overlap, _rates(packing, found))) > _OF_THIN:
        return False
    loose += thin + _OF_POWERS * (law.alpha != 1)
    moved = found.moved and law.at_contacts
    if loose > _LOOSEST or not _compare_drag(packing, law, background, found, loose + _OF_MOVED * moved) or moved:
        return False
    touching = packing.kind.pairs(packing)
    if packing.kind.rotations(packing) and len(touching.i) <= len(np.union1d(touching.i, touching.j)):
        return False  # disks in chains roll, so that no drag on sliding is seen
    _agreed.add(key)
    return True


def _compare_drag(packing: Packing, law: DragLaw, background: float, found: Evaluated, loose: float) -> bool:
    """Compare the dissipated power, and tell whether particles dissipate that do not follow the flow."""
    rates, who, power = _rates(packing, found), f"the drag law, {law},", _power(packing, law, background)
    if np.abs(rates).max() < _STILL:
        return False
    expected, beside_flow = power(rates), power(np.append(rates[:-1], 0.0))
    if not beside_flow > _TELLING * expected:  # of what follows the flow the flow dissipates all of the power
        _check("dissipated power per area", found.dissipation, expected, (loose + _SUMS) * expected, who)
        return False
    signs = np.random.default_rng(len(rates)).choice([-1.0, 1.0], len(rates))
    apart = max(expected, beside_flow, power(rates * signs))  # of velocities that do not cancel at contacts
    allowed = loose * min(expected, beside_flow) + _SUMS * apart
    if expected < _RIGID * apart:
        _check("dissipated power per area", found.dissipation, expected, allowed + _RIGID * apart, who)
        return False
    if abs(found.dissipation - expected) > allowed:  # velocities may be large beside their differences at contacts
        noise = 1.0 + _NOISE * np.random.default_rng(len(rates)).standard_normal(len(rates))
        allowed += abs(power(rates * noise) - expected)
        if found.moved:  # a little before and after, contacts may slip otherwise
            near = (_along_the_way(packing, rates, way) for way in (-_CORRECTED, _CORRECTED))
            allowed += max(abs(_power(each, law, background)(rates) - expected) for each in near)
    _check("dissipated power per area", found.dissipation, expected, allowed, who)
    least = expected - _gain_by_spins(packing, power, rates, expected)
    allowed += max(_OF_SPINS, loose) * beside_flow
    _check("dissipated power per area, beside that of other spins,", expected, least, allowed, who)
    return True


def _share_of_thin(packing: Packing, overlap: Array, rates: Array) -> float:
    """Largest relative error of the drag at thin contacts, which the plugin drags as thicker ones."""
    least = _THIN * float(overlap.mean())
    thin = overlap < least
    if packing.law.springs or not thin.any():
        return 0.0
    size = np.full(int(thin.sum()), mean_size(packing))
    reached = size + packing.law.range
    ratio = packing.law.drag_stiffness(size, reached - least) / packing.law.drag_stiffness(
        size, reached - overlap[thin]
    )
    approach, slide, stiffness = slips(packing, rates)
    power = stiffness * (approach**2 + slide**2)
    return float(np.abs(ratio - 1) @ power[thin] / power.sum()) if power.any() else np.inf


def _gain_by_spins(packing: Packing, power: Callable[[Array], float], rates: Array, here: float) -> float:
    """How much less power other spins would dissipate: spins cost no energy but drag, so there are none. Spins that are
    0 for want of drag in the plugin would dissipate what the analysis says, and differ from its spins."""
    first, spins = 2 * len(packing.positions), packing.kind.rotations(packing)
    moved = float(np.abs(rates[:first]).max(initial=0.0)) / mean_size(packing)
    if not spins or not moved:
        return 0.0
    aside, step = np.zeros_like(rates), _STEP * moved
    turned = np.random.default_rng(spins).choice([-1.0, 1.0], spins)
    aside[first : first + spins] = np.where(packing.frame.fixed, 0.0, turned)
    more, less = power(rates + step * aside), power(rates - step * aside)
    slope, curvature = 0.5 * (more - less) / step, (more - 2 * here + less) / step**2
    return float(0.5 * slope**2 / curvature) if curvature * step**2 > _SUMS * here else 0.0


def _along_the_way(packing: Packing, rates: Array, length: float) -> Packing:
    """The packing after the fastest site has gone so far beside the flow."""
    way = rates[: packing.positions.size].reshape(packing.positions.shape)
    return packing.with_state(positions=packing.positions + length / (np.abs(way).max() or 1.0) * way)


def _rates(packing: Packing, found: Evaluated) -> Array:
    """Rates of all coordinates, as drag laws take them."""
    spins = found.velocities[:, 2] if packing.kind.rotations(packing) else np.zeros(0)
    return np.concatenate([found.velocities[:, :2].ravel(), spins, [found.rate]])


def _power(packing: Packing, law: DragLaw, background: float) -> Callable[[Array], float]:
    """Power per area that is dissipated at some rates, by the Rayleigh functions of the analysis."""
    beside = StokesDrag(eta_f=0.0, tau=background * law.tau) if background else None
    laws = [each for each in (law, beside) if each is not None]
    return lambda rates: sum(each.power(packing, rates) for each in laws) / packing.area


def _check(what: str, found: float, expected: float, allowed: float, who: str) -> None:
    if not abs(found - expected) <= allowed:
        raise EngineError(
            f"{what} in flow: the plugin has {found:.10g}, the analysis {expected:.10g}. {who} "
            f"and what jamlab tells the plugin by words are two laws: see {EXTENDING}"
        )
