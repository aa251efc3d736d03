"""Define the points of a speed-accuracy chart, and find those that no other point beats."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

SLACK = 1.2  # a time must be this much shorter to count as shorter: what repeated runs differ by
ALIKE = 1.05  # errors within this ratio are the same
FLOOR = 1e-16  # errors below are drawn here


@dataclass(frozen=True)
class Trial:
    """A method with one setting, measured.

    Attributes:
        panel: which chart of the topic.
        method: name.
        setting: its parameter, as text.
        seconds: CPU time on one core.
        error: against the reference of the topic; nan if the method gave no number, and `note` says why.
        default: whether jamlab does this by default.
        note: what a reader must know.
    """

    panel: str
    method: str
    setting: str
    seconds: float
    error: float
    default: bool = False
    note: str = ""


@dataclass(frozen=True)
class Topic:
    """A set of trials of one kind, before they are made.

    Attributes:
        title: of the chart.
        error: label of the axis of errors.
        reference: what the error is measured against.
        measure: function of `quick` that makes the trials.
        verdict: what the chart says about jamlab's default, unless the marks show it.
    """

    title: str
    error: str
    reference: str
    measure: Callable[[bool], list[Trial]]
    verdict: str = ""


def dominated(trials: Sequence[Trial]) -> NDArray[np.bool_]:
    """Mark the trials (m,) for which another one of the same panel is as good and faster, or better and as fast.

    Times within 20 % of each other count as equal, and errors within 5 %. Trials without a number count as dominated.
    """
    beaten = np.zeros(len(trials), dtype=bool)
    for k, one in enumerate(trials):
        beaten[k] = not np.isfinite(one.error) or any(_beats(other, one) for other in trials)
    return beaten


def _beats(other: Trial, one: Trial) -> bool:
    if other.panel != one.panel or other is one or not np.isfinite(other.error):
        return False
    mine, its = max(one.error, FLOOR), max(other.error, FLOOR)
    faster = other.seconds * SLACK < one.seconds
    return (its <= ALIKE * mine and faster) or (ALIKE * its < mine and other.seconds <= one.seconds)
