"""States of a sweep that take far more steps of minimizers than is usual there: the log says why."""

import logging
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

DEAR = 20.0  # steps of a state over the median of the sweep so far, from which on the log says why
FEWEST = 3  # states of which a median is taken

_log = logging.getLogger(__name__)


def name_detours(detours: Mapping[str, int]) -> str:
    """What a state took beside one minimisation, such as "3 slides along modes that give way"; "" for nothing."""
    return ", ".join(f"{count} {what}" for what, count in detours.items())


@dataclass
class Costs:
    """What the states of one sweep have cost so far."""

    _states: list[tuple[int, str]] = field(default_factory=list)
    _told: set[int] = field(default_factory=set)

    def add(self, steps: int, state: str) -> None:
        """Note a state, and tell the log of those that are dear beside all up to now: a first state is compared with
        the two after it.

        Args:
            steps: of minimizers that the state took.
            state: the state and what it took, for the log.
        """
        self._states.append((steps, state))
        if len(self._states) < FEWEST:
            return
        usual = float(np.median([count for count, _ in self._states]))
        for number, (count, what) in enumerate(self._states):
            if count > DEAR * usual and number not in self._told:
                self._told.add(number)
                _log.info("%d steps of minimizers, where %.0f are usual: %s", count, usual, what)
