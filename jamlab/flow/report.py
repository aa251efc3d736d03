"""Say in words what a flow has reached, and how well its energy is balanced: the one place that writes sentences.

Results hold numbers. `report` needs of a result its `state`, a word; its `summary`, names and numbers; and
`energy_error`, `energy_tolerance` and `remedy`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from jamlab.plotting.drawable import LEGEND
from jamlab.plotting.palette import RED

LEAST_SHOWN = 1e-4

Number = float | str | tuple[float, float] | Sequence[float]  # one, in words, with its standard error, or several


def report(result: Any) -> str:
    """Write all that there is to say of a result, as its `repr`."""
    return f"{type(result).__name__}({describe(result)}; {conclude(result)})"


def describe(result: Any) -> str:
    """Name drag and accuracy of a result, and how well its energy is balanced."""
    words = [] if result.damping is None else [str(result.damping)]
    words += [f"background drag {result.background_drag:g} k τ1"] if result.background_drag else []
    forces = [f"force tolerance {result.force_tolerance:g}"] if result.tolerance is None else []
    words += [*(forces or [f"tolerance {result.tolerance:g}"]), describe_balance(result)]
    trajectory_error = getattr(result, "relative_trajectory_error", float("nan"))
    words += [f"error of the trajectory {100 * trajectory_error:.2g} %"] if np.isfinite(trajectory_error) else []
    guessed = int(np.sum(result.ambiguous_contacts))
    return ", ".join(words + ([f"{guessed} ambiguous contact changes"] if guessed else []))


def conclude(result: Any) -> str:
    """Name state and numbers of a result, and what to do if its energy is not balanced."""
    settled = (
        "rests",
        "flows",
        "relaxed",
        "periodic",
        "steady",
        "start-up",
        "jammed",
    )  # any other state is written large
    state = result.state if result.state in settled else result.state.upper()
    words = ", ".join([state, *(f"{name} = {_write(number)}" for name, number in result.summary.items())])
    if worst_imbalance(result) <= result.energy_tolerance:
        return words
    remedy = ", or ".join(f"{name} = {value:g}" for name, value in result.remedy.items())
    limit = 100 * result.energy_tolerance
    return f"{words}; ENERGY BALANCE OFF by {_percent(result)}, above {limit:g} %: give {remedy}"


def describe_balance(result: Any) -> str:
    """Say how well the energy of a result is balanced."""
    return f"energy balance to {_percent(result)}"


def worst_imbalance(result: Any) -> float:
    """Largest imbalance of a result, which has one number or one of each part."""
    return float(np.max(result.energy_error, initial=0.0))


def say_balance(axes: Any, result: Any) -> None:
    """Title axes with a warning if energy is not balanced; of several runs, the last such one."""
    if worst_imbalance(result) > result.energy_tolerance:
        axes.set_title(f"{describe_balance(result)}: DOUBTFUL", fontsize=LEGEND, loc="right", color=RED)


def _percent(result: Any) -> str:
    imbalance = worst_imbalance(result)
    return f"{100 * imbalance:.2g} %" if imbalance > LEAST_SHOWN else f"better than {100 * LEAST_SHOWN:g} %"


def _write(number: Number) -> str:
    if isinstance(number, str):
        return number
    if isinstance(number, tuple):
        return f"{number[0]:.4g} ± {number[1]:.1g}"
    return ", ".join(f"{each:.4g}" for each in np.atleast_1d(number))
