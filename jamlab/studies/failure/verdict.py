"""Judge one run of a map of failure: by what it says of itself, and by a check that shares no code with it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from jamlab.errors import JamlabError
from jamlab.packing.packing import Packing
from jamlab.studies.failure.plain_physics import plain_max_force

_RUNAWAY = 10.0  # times the energy at the start: a descent loses energy, rounding gains far less than this
_SAME_BASIN = 1e-6  # relative difference of energies: far above what a force within tolerance leaves of them
_ROUNDING = 30 * np.finfo(np.float64).eps  # of forces of order 1, summed in another order

SILENT = "silent"
VERDICTS = ("converged", "another basin", "stalled", "blew up", "refused", SILENT)
_CLAIMS = ("converged", "another basin")  # give a number as if it were right


@dataclass(frozen=True)
class Trial:
    """One run."""

    # one of `VERDICTS`. "converged": met its tolerance where it should. "another basin": met it in another minimum.
    # "stalled": said that it ended above its tolerance. "blew up": positions or energies ran away, for all to see.
    # "refused": jamlab raised an error instead of giving a number. "silent": gave a number as if it were right, and the
    # check says that it is wrong.
    verdict: str
    note: str = ""  # what the run reached, or the message of the error
    error: float = 0.0  # of what is claimed, by the independent check; 0 where nothing is
    allowed: float = np.inf  # the largest error that the claim leaves room for

    @property
    def excess(self) -> float:
        """Error over the allowed one, of claims; not finite where the check found no number."""
        return self.error / self.allowed if self.verdict in (*_CLAIMS, SILENT) else 0.0


def judged(trial: Trial) -> Trial:
    """Give the verdict "silent" to a claim that the check refutes."""
    if trial.verdict in _CLAIMS and not trial.error <= trial.allowed:
        note = f"{trial.note}; error {trial.error:.2g}, allowed {trial.allowed:.2g}"
        return Trial(SILENT, note, trial.error, trial.allowed)
    return trial


def attempt(run: Callable[[], Trial]) -> Trial:
    """Make a run and judge it; an error of jamlab counts as "refused", any other passes through."""
    try:
        trial = run()
    except JamlabError as error:
        return Trial("refused", str(error).splitlines()[0])
    return judged(trial)


def judge_descent(left: float, tolerance: float, energy: float, start: float, minimum: float) -> str:
    """Judge a minimisation by the largest force left, and by energies at its end, its start and the minimum beside."""
    if not (np.isfinite(left) and np.isfinite(energy)) or energy > _RUNAWAY * start:
        return "blew up"
    if left > tolerance:
        return "stalled"
    return "converged" if abs(energy - minimum) <= _SAME_BASIN * minimum else "another basin"


def balanced(verdict: str, packing: Packing, tolerance: float, note: str = "", stiffness: float = 1.0) -> Trial:
    """Check the claim that no force above a tolerance is left, by forces computed anew. Rounding of positions is
    multiplied with a stiffness, force over length."""
    left = plain_max_force(packing)
    size = float(np.abs(packing.box).max())
    return Trial(verdict, note or f"max force {left:.1g}", left, tolerance + _ROUNDING * max(1.0, stiffness * size))


def worst_of(*trials: Trial) -> Trial:
    """Of several checks of one run, which has one verdict, the one that it fails by most."""
    if len({trial.verdict for trial in trials}) > 1:
        raise ValueError(f"checks of one run with several verdicts: {[trial.verdict for trial in trials]}")
    return max(trials, key=lambda trial: trial.excess if np.isfinite(trial.excess) else np.inf)
