"""Judge the runs of a map of failure: converged, stalled, in the wrong basin, blown up, or refused."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from jamlab.engine.session import Session
from jamlab.errors import JamlabError
from jamlab.packing.packing import Packing
from jamlab.protocols.relaxation import relax

_RUNAWAY = 10.0  # times the energy at the start: a descent loses energy, rounding gains far less than this
_SAME_BASIN = 1e-6  # relative difference of energies: far above what a force within tolerance leaves of them

VERDICTS = ("converged", "stalled", "wrong basin", "blew up", "refused")


@dataclass(frozen=True)
class Outcome:
    """A point of a map: what one run came to.

    Attributes:
        x, y: its place; numbers, or names on axes without a scale.
        verdict: one of `VERDICTS`. "converged": met its tolerance, in the basin it started from. "stalled": ended above
            it. "wrong basin": met it elsewhere. "blew up": positions or energies ran away. "refused": jamlab raised an
            error instead of giving a number.
        note: what the run reached, or the message of the error.
    """

    x: float | str
    y: float | str
    verdict: str
    note: str = ""


@dataclass(frozen=True)
class Map:
    """A map of failure, before it is measured.

    Attributes:
        title, x, y: of the chart and its axes.
        measure: function of `quick` that makes the runs and judges them.
        meaning: what the map shows.
        mark: (x, y) of jamlab's default, None on an axis without one.
    """

    title: str
    x: str
    y: str
    measure: Callable[[bool], list[Outcome]]
    meaning: str
    mark: tuple[float | str | None, float | str | None] = (None, None)


def attempt(x: float | str, y: float | str, run: Callable[[], tuple[str, str]]) -> Outcome:
    """Make a run that returns its verdict and a note; an error of jamlab counts as "refused"."""
    try:
        verdict, note = run()
    except JamlabError as error:
        return Outcome(x, y, "refused", str(error).splitlines()[0])
    return Outcome(x, y, verdict, note)


def judge(left: float, tolerance: float, energy: float, start: float, minimum: float) -> str:
    """Judge a minimisation.

    Args:
        left: largest force at its end.
        tolerance: the force asked for.
        energy: at its end.
        start: energy at its start.
        minimum: energy of the minimum whose basin it started in.
    """
    if not (np.isfinite(left) and np.isfinite(energy)) or energy > _RUNAWAY * start:
        return "blew up"
    if left > tolerance:
        return "stalled"
    return "converged" if abs(energy - minimum) <= _SAME_BASIN * minimum else "wrong basin"


def try_relaxing(packing: Packing) -> tuple[str, str]:
    """Judge `relax` on a packing."""
    with Session(packing) as session:
        found = relax(session)
    left = found.evaluation.max_force
    return ("converged" if found.converged else "stalled"), f"max force {left:.1g}"
