"""A map of failure: two conditions, the runs at every pair of them, and what their shares say."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from jamlab.errors import JamlabError
from jamlab.studies.failure.verdict import VERDICTS, Trial, attempt

COLUMNS = ("x", "y", "runs", *VERDICTS, "worst", "limit", "note")


@dataclass(frozen=True)
class Axis:
    """One condition of a map.

    Attributes:
        label: with its unit.
        values: numbers, or names on an axis without a scale.
        default: jamlab's own, None where it has none.
        logarithmic: whether factors count, or differences.
    """

    label: str
    values: tuple[float | str, ...]
    default: float | None = None
    logarithmic: bool = True

    def places(self, values: Any) -> Any:
        """Where values lie between the cells 0, 1, 2, ... of the axis; up to half a cell beyond the ends."""
        known = np.array([float(v) for v in self.values])
        scale = np.log if self.logarithmic else np.asarray
        inside = np.interp(scale(values), scale(known), np.arange(len(known)))
        below, above = scale(values) < scale(known[0]), scale(values) > scale(known[-1])
        return inside - 0.5 * below + 0.5 * above

    def text(self, value: float | str) -> str:
        """A value as a label."""
        return value if isinstance(value, str) else f"{value:.3g}"


def log_axis(label: str, low: float, high: float, default: float | None = None, count: int = 12) -> Axis:
    """An axis with equal factors between its values, each rounded to three digits."""
    return Axis(label, tuple(float(f"{v:.3g}") for v in np.geomspace(low, high, count)), default)


def linear_axis(label: str, low: float, high: float, default: float | None = None, count: int = 12) -> Axis:
    """An axis with equal differences between its values, each rounded to four digits."""
    return Axis(label, tuple(float(f"{v:.4g}") for v in np.linspace(low, high, count)), default, logarithmic=False)


@dataclass(frozen=True)
class Map:
    """A map before it is measured.

    Attributes:
        title: of the chart.
        x, y: conditions: x the dial of a method, y what it works on.
        seeds: runs at every pair.
        prepare: function of y and seed: where the runs of a row start.
        run: function of what is prepared and x: one run.
        meaning: what the map shows.
        check: what the independent check of every run is.
        limit: function of what is prepared: x where theory puts the boundary.
        limit_label: what that is.
        elsewhere: what "another basin" is in this map.
    """

    title: str
    x: Axis
    y: Axis
    seeds: int
    prepare: Callable[[Any, int], Any]
    run: Callable[[Any, Any], Trial]
    meaning: str
    check: str
    limit: Callable[[Any], float] | None = None
    limit_label: str = ""
    elsewhere: str = "another basin"

    def rows(self, y: float | str) -> Iterator[dict[str, Any]]:
        """Make all runs of one y, and count their verdicts for every x."""
        starts, limits, refusals = [], [], []
        for seed in range(1, self.seeds + 1):
            try:
                starts.append(self.prepare(y, seed))
            except JamlabError as error:  # then every run of the row is refused
                refusals.append(Trial("refused", str(error).splitlines()[0]))
                continue
            if self.limit is not None:
                limits.append(self.limit(starts[-1]))
        limit = float(np.median(limits)) if limits else float("nan")
        for x in self.x.values:
            trials = [attempt(partial(self.run, start, x)) for start in starts] + refusals
            yield {"x": x, "y": y, **summary(trials), "limit": limit}

    def try_once(self, x: float | str, y: float | str, seed: int = 1) -> Trial:
        """Make the run of one seed at one pair of conditions."""
        return attempt(lambda: self.run(self.prepare(y, seed), x))


def summary(trials: list[Trial]) -> dict[str, Any]:
    """Count verdicts; the worst error over what is allowed, and what the worst run says."""
    worst = max(trials, key=lambda trial: (VERDICTS.index(trial.verdict), trial.excess))
    return {
        "runs": len(trials),
        **{verdict: sum(trial.verdict == verdict for trial in trials) for verdict in VERDICTS},
        "worst": max(trial.excess for trial in trials),
        "note": "" if worst.verdict == "converged" else worst.note[:100],
    }


def shares(chart: Map, table: pd.DataFrame, verdict: str) -> np.ndarray:
    """(y, x) share of the runs that ended in a verdict; not a number where none was made."""
    found = np.full((len(chart.y.values), len(chart.x.values)), np.nan)
    xs, ys = ([_name(v) for v in axis.values] for axis in (chart.x, chart.y))
    for x, y, count, runs in zip(table["x"], table["y"], table[verdict], table["runs"], strict=True):
        found[ys.index(_name(y)), xs.index(_name(x))] = count / runs
    return found


def limits_of_rows(chart: Map, table: pd.DataFrame) -> np.ndarray:
    """(y,) limit of theory in each row; not a number where there is none."""
    known = {_name(y): float(limit) for y, limit in zip(table["y"], table["limit"], strict=True)}
    return np.array([known.get(_name(y), np.nan) for y in chart.y.values])


def _name(value: Any) -> str:
    return value if isinstance(value, str) else f"{value:.6g}"
