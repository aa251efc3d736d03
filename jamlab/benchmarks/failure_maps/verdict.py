"""One run of a stability map, and what came of it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from jamlab.engine.session import Session
from jamlab.errors import JamlabError
from jamlab.packing.packing import Packing
from jamlab.protocols.relaxation import relax

VERDICTS = ("converged", "stalled", "wrong basin", "blew up", "refused")


@dataclass(frozen=True)
class Run:
    """A point of a map.

    Attributes:
        x, y: its place; numbers, or names for axes without scale.
        verdict: one of `VERDICTS`. "converged": met its tolerance, in the basin it started from. "stalled": ended above
            it. "wrong basin": met it elsewhere. "blew up": positions or energies ran away. "refused": jamlab raised an
            error instead of giving a number.
        note: numbers, or the words of the refusal.
    """

    x: float | str
    y: float | str
    verdict: str
    note: str = ""


@dataclass(frozen=True)
class Map:
    """A map of failure.

    Attributes:
        title, x, y: of the chart and its axes.
        runs: function of `quick` that does the runs.
        meaning: what the map says.
        mark: (x, y) of jamlab's default, None on an axis without one.
    """

    title: str
    x: str
    y: str
    runs: Callable[[bool], list[Run]]
    meaning: str
    mark: tuple[float | str | None, float | str | None] = (None, None)


def refusal(x: float | str, y: float | str, run: Callable[[], tuple[str, str]]) -> Run:
    """The run with its verdict and note, or that jamlab refused."""
    try:
        verdict, note = run()
    except JamlabError as error:
        return Run(x, y, "refused", str(error).splitlines()[0])
    return Run(x, y, verdict, note)


def judged(left: float, tolerance: float, energy: float, start: float, minimum: float) -> str:
    """Verdict on a minimisation.

    Args:
        left: largest force at its end; tolerance: asked for.
        energy: at its end; start: at its start; minimum: of the basin it started from.
    """
    if not (np.isfinite(left) and np.isfinite(energy)) or energy > 10 * start:
        return "blew up"
    if left > tolerance:
        return "stalled"
    return "converged" if abs(energy - minimum) <= 1e-6 * minimum else "wrong basin"


def relaxed(packing: Packing) -> tuple[str, str]:
    """Verdict of `relax` on a packing."""
    with Session(packing) as session:
        found = relax(session)
    left = found.evaluation.max_force
    return ("converged" if found.converged else "stalled"), f"max force {left:.1g}"
