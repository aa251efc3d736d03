"""Measure the controls of estimators, and say which rows of `statements.csv` may have a verdict.

`controls.csv` names the law of each number, or the reason why its estimator needs no control. The law goes through our
packings (`stated`) and through sample and statistic of the row with the same settings; packings are drawn anew for each
repeat. An estimator passes if what it gives lies within the tolerance of the rule with 95 % confidence.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from inspect import signature
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.checks import check_choice
from jamlab.errors import JamlabError
from jamlab.processes.progress import Progress, told
from jamlab.storage.atomic_file import make_folder
from studies.ensemble_tables import EnsembleTables
from studies.papers.controls import stated as ways
from studies.papers.controls.passed import NAME, Control
from studies.papers.statements import Statement, analyse, find, keywords, names, paper, statements
from studies.papers.verdicts import NORMAL, ONE_SIDED, TOLERANCE, scale
from studies.reference_data import round_numbers
from studies.tables import write_table

FILE = Path(__file__).with_name("controls.csv")
REPEATS, MOST = 40, 640  # of packings drawn anew: more as long as the error of their mean matters
KNOWN = 0.25  # of the tolerance, to which a bias should be known
DISKS = "disks"  # control whose law is established in disks: the same estimator, our disks, no synthetic data


@dataclass(frozen=True)
class Plan:
    """How the estimator of a number is controlled."""

    id: str
    way: str  # function of `stated`, DISKS, or "" where no control is needed
    settings: str  # keywords of it; `expected`: what the law gives where that is not the paper's value
    reason: str  # what the law is, or why none is needed

    @property
    def expected(self) -> float:
        """What an estimator without bias gives."""
        return float(keywords(self.settings).get("expected", paper(self.id)))


@cache
def plans() -> tuple[Plan, ...]:
    """Read how estimators are controlled, a row each; a number may have several controls."""
    table = pd.read_csv(FILE, dtype=str, keep_default_na=False)
    return tuple(Plan(*row) for row in table[["id", "control", "settings", "reason"]].itertuples(index=False))


def tolerance(s: Statement, value: float) -> float:
    """How far a number may lie off, as in `studies.papers.verdicts.judge`."""
    return max(TOLERANCE * scale(s.number, value), s.margin)


def doubt(values: Array) -> float:
    """95 % upper limit of how far the mean of repeats lies from the mean of many; nan if most have no value."""
    kept = values[np.isfinite(values)]
    return ONE_SIDED * float(kept.std(ddof=1)) / len(kept) ** 0.5 if len(kept) > max(len(values) // 2, 1) else np.nan


def judge(plan: Plan, plain: float, values: Array) -> Control:
    """Say whether an estimator gives what it should, from what it gives in repeats; of disks in our one sample."""
    kept, allowed = values[np.isfinite(values)], tolerance(statements()[plan.id], plan.expected)
    unsure, scatter = doubt(values), float(kept.std(ddof=1)) if len(kept) > 1 else np.nan
    disks = plan.way == DISKS
    mean, error = (plain, scatter) if disks else (float(kept.mean()) if len(kept) else np.nan, unsure / ONE_SIDED)
    passes = abs(mean - plan.expected) + (0.0 if disks else unsure) <= allowed * (1 + 1e-9)
    return Control(plan.id, plan.way, plan.reason, plan.expected, plain, mean, error, scatter, allowed, bool(passes))


def place_of(s: Statement) -> int:
    """Which of the numbers of an analysis that rows share is theirs."""
    alike = [other.id for other in statements().values() if other.analysis == statements()[s.id].analysis]
    return alike.index(s.id)


def repeat(s: Statement, tables: EnsembleTables, allowed: float) -> tuple[float, Array]:
    """Measure a number in some tables, and in packings drawn anew from them (repeats,)."""
    if not s.sample:  # the statistic takes tables and gives its own interval: as if of three repeats
        found = analyse(s, tables)[place_of(s)]
        error = (found.high - found.low) / NORMAL
        return found.value, found.value + error * np.array([-1, 0, 1])
    function, sampler, given = find(s.statistic), find(s.sample), keywords(s.settings)
    own = {*signature(sampler).parameters}
    given.pop("resamples", None)
    taken = sampler(tables, **{k: v for k, v in given.items() if k in own})
    rest = {k: v for k, v in given.items() if k not in own}
    rng = np.random.default_rng(crc32(s.id.encode()))

    def once(drawn: list[Array]) -> float:
        try:
            found = np.atleast_1d(np.asarray(function(*taken.reduce(drawn), **rest), dtype=np.float64))
        except JamlabError:
            return float("nan")
        return float(found[min(place_of(s), len(found) - 1)])

    def draw() -> list[Array]:
        return [g.take(rng.integers(len(g), size=len(g)), axis=0) for g in groups]

    groups, again = list(taken.groups), np.empty(0)
    while len(again) < REPEATS or (len(again) < MOST and not doubt(again) <= KNOWN * allowed):
        again = np.append(again, [once(draw()) for _ in range(len(again) or REPEATS)])
    return once(groups), again


def run(plan: Plan, tables: EnsembleTables) -> Control:
    """Measure one control."""
    s, given = statements()[plan.id], keywords(plan.settings)
    value, allowed = given.pop("expected", s.value), tolerance(s, plan.expected)
    if plan.way == DISKS:
        settings = s.settings.replace("dp", "sp").replace("_strong", "")
        return judge(plan, *repeat(replace(s, settings=settings), tables, allowed))
    way = getattr(ways, plan.way)
    return judge(plan, *repeat(s, way(tables, s, stated=given.pop("stated", value), **given), allowed))


def write_controls(
    folder: Path, tables: EnsembleTables, ids: Sequence[str] = (), progress: Progress | None = None
) -> Path:
    """Measure all controls, or those of some numbers, and write their table."""
    wanted = [plan for plan in plans() if plan.way and (not ids or plan.id in ids)]
    for name in ids:
        check_choice("number", name, [plan.id for plan in plans() if plan.way])
    make_folder(folder)
    rows: list[Mapping[str, Any]] = []
    for k, plan in enumerate(wanted):
        told(progress)(k / len(wanted), f"control {k + 1} of {len(wanted)}: {plan.id}")
        rows.append(vars(run(plan, tables)))
    return write_table(folder, NAME, round_numbers(pd.DataFrame(rows)))


def uncontrolled() -> list[str]:
    """List numbers that are tested and have neither a control nor a reason why none is needed."""
    known = {plan.id for plan in plans()}
    shown = [name for figure in {s.figure for s in statements().values()} for name in names(figure)]
    return [name for name in shown if statements()[name].tested and statements()[name].statistic and name not in known]
