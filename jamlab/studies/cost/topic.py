"""Define what is charted: a topic measures, packing by packing, every method at every setting of its dial."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Any
from unittest import mock

import pandas as pd

from jamlab.studies.cost.curve_points import Point, points_of
from jamlab.studies.table import MeasuredTable, Progress, measure_table, shipped_table

SEEDS = range(1, 21)  # packings of a chart


@dataclass(frozen=True)
class Trial:
    """One method with one setting on one packing, measured.

    Attributes:
        panel: which chart of the topic.
        method: name.
        setting: where its dial stands, as text; "" without a dial.
        seconds: CPU time on one core.
        error: difference to the reference, with its sign; nan if the method gave no number, and `note` says why.
        reference_error: of the reference itself, on this packing.
        default: whether jamlab does this by default.
        note: what a reader must know.
    """

    panel: str
    method: str
    setting: str
    seconds: float
    error: float
    reference_error: float = 0.0
    default: bool = False
    note: str = ""


COLUMNS = tuple(field.name for field in fields(Trial))


@dataclass(frozen=True)
class Topic:
    """A chart, before it is measured.

    Attributes:
        title: of the chart.
        error: label of the axis of errors.
        dial: what the settings are.
        reference: what the error is measured against, and how well that is known.
        measure: function of a seed that makes the trials of one packing.
        seeds: of the packings.
        points: function that makes the points of the curves from all trials.
        reason: why a default may lie off its front, in one line; "" if none does.
    """

    title: str
    error: str
    dial: str
    reference: str
    measure: Callable[[int], Iterable[Trial]]
    seeds: Sequence[int] = SEEDS
    points: Callable[[pd.DataFrame], list[Point]] = points_of
    reason: str = ""


def shipped_trials(name: str) -> MeasuredTable:
    """Trials of a topic as they ship with jamlab.

    Raises:
        StorageError: none ship for this topic.
    """
    return shipped_table("jamlab.studies.cost", name)


def measure_trials(
    path: Path, topic: Topic, seeds: Sequence[int] | None = None, progress: Progress = lambda name, done, of: None
) -> MeasuredTable:
    """Measure the packings of a topic that a file does not hold yet, see `measure_table`.

    The first one is measured twice: the first time also loads libraries.
    """
    warm = False

    def rows(seed: int) -> list[dict[str, Any]]:
        nonlocal warm
        if not warm:
            list(topic.measure(seed))
            warm = True
        return [asdict(trial) for trial in topic.measure(seed)]

    tasks = {str(seed): partial(rows, seed) for seed in (topic.seeds if seeds is None else seeds)}
    facts = {"title": topic.title, "error": topic.error, "reference": topic.reference}
    return measure_table(path, COLUMNS, tasks, facts, progress=progress)


def with_settings(module: Any, name: str = "SETTINGS", **changes: Any) -> Any:
    """Context in which the frozen settings of a solver's module have other values."""
    return mock.patch.object(module, name, replace(getattr(module, name), **changes))
