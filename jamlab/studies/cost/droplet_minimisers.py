"""Minimisers of droplets, LAMMPS' own and jamlab's, from a minimum that was kicked, by the force that is left."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from jamlab.engine.session import Session
from jamlab.errors import EngineError
from jamlab.estimates.ensemble_way import bring_on, default_way
from jamlab.packing.packing import Packing
from jamlab.protocols.onset import jam
from jamlab.protocols.relaxation import force_tolerance, relax
from jamlab.studies.cost.topic import Topic, Trial
from jamlab.studies.cpu_time import shortest

_RHO = (0.88, 0.95)
_N = 8
_KICK = 0.003  # mean diameters: far more than any force tolerance leaves, less than half a rim
_STYLES = ("fire", "cg")  # with the settings of the decks, minimize.fire and minimize.cg
_STEPS = 20_000  # bound
_TOLERANCES = (1e-3, 1e-4, 1e-6, 1e-8, 1e-10)
_ROUNDING = 1e-14  # of a sum of forces: distances err by 1e-16, and the stiffness of a rim is 1/delta^2


def measure(seed: int) -> Iterator[Trial]:
    """Measure at both packing fractions, from the loosest tolerance until one is not met."""
    onset = jam("sp", _N, seed)
    for rho in _RHO:
        start = _kicked(bring_on(default_way(_N), onset, rho), seed)
        with Session(start) as session:
            for style in (*_STYLES, "jamlab relax"):
                note = ""
                for tolerance in _TOLERANCES:
                    seconds = left = float("nan")
                    if not note:
                        try:
                            seconds, left = shortest(partial(_descend, session, start, style, tolerance), runs=1)
                            note = "" if left <= tolerance else f"ends at {left:.1g}"
                        except EngineError as error:
                            note = str(error).splitlines()[0]
                    error_left = float("nan") if note else left
                    default = style == "jamlab relax" and tolerance == force_tolerance("dp")
                    yield Trial(f"ρ = {rho}", style, f"{tolerance:g}", seconds, error_left, _ROUNDING, default, note)


def _kicked(packing: Packing, seed: int) -> Packing:
    moves = _KICK * np.random.default_rng(seed).standard_normal(packing.positions.shape)
    return packing.with_state(positions=packing.positions + moves)


def _descend(session: Session, start: Packing, style: str, tolerance: float) -> float:
    session.load(start, anew=True)
    if style in _STYLES:
        return session.minimize(tolerance, style=style, steps=_STEPS).max_force
    return relax(session, tolerance).evaluation.max_force


TOPIC = Topic(
    f"Minimisers of {_N} droplets",
    "largest force left, ε/d",
    "force tolerance",
    "no force at all, to the rounding of a sum of forces, 1e-14; all start from one minimum whose vertices are moved "
    "by 0.003 diameters. What ends above its tolerance, after 20 000 steps or where its line search finds no way down, "
    "counts as failed",
    measure,
)
