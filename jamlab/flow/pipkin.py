"""Pipkin diagram: Lissajous figures over frequency and amplitude, from linear elastic to flowing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.flow.oscillate import Oscillation
from jamlab.flow.report import say_balance
from jamlab.plotting.drawable import CURVES, LABEL, label_axes, merged_line

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@checked
def plot_pipkin(oscillations: Sequence[Oscillation], ax: Any = None, **style: Any) -> Axes:
    """Draw stress over strain of oscillations, scaled to one size, each at its frequency and amplitude.

    Colour says how large the third harmonic is beside the first.

    >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
    >>> found = [jamlab.oscillate(p, w, a, cycles=2) for w in (1.0, 3.0) for a in (0.01, 0.1)]
    >>> ax = jamlab.plot_pipkin(found)

    Args:
        oscillations: one or more.
        ax: matplotlib Axes; by default those of a new figure.
        style: of matplotlib's Line2D, of all loops.

    Raises:
        InputError: no oscillation, `ax` is something else, or matplotlib refuses the style.
    """
    from jamlab.plotting.axes import axes_for

    if not len(oscillations):
        raise InputError("a Pipkin diagram needs an oscillation: give results of jamlab.oscillate")
    with axes_for(ax, style, CURVES) as axes:
        _draw(axes, oscillations, **style)
    return axes


def _draw(axes: Any, oscillations: Sequence[Oscillation], **style: Any) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    axes.set_xscale("log")
    axes.set_yscale("log")
    places = np.log10([[each.omega, each.amplitude] for each in oscillations])
    width, height = (_spacing(values) for values in places.T)
    shares = [each.third_over_first for each in oscillations]
    colours = ScalarMappable(Normalize(0.0, max(*shares, 1e-2)), "viridis")
    for each, share in zip(oscillations, shares, strict=True):
        rows = each.last_cycle
        stress = each.stress[rows] - each.stress[rows][1:].mean()
        x = each.omega * 10 ** (0.4 * width * each.strain[rows] / each.amplitude)
        y = each.amplitude * 10 ** (0.4 * height * stress / np.abs(stress).max())
        axes.plot(x, y, **merged_line({"color": colours.to_rgba(np.array(share)), "linewidth": 1.4}, style))
    label_axes(axes, r"angular frequency $\omega\,\tau_1$", r"amplitude $\gamma_0$")
    scale = axes.figure.colorbar(colours, ax=axes)
    scale.set_label(r"third harmonic over first, $|G^*_3|/|G^*_1|$", fontsize=LABEL)
    say_balance(axes, *oscillations)


def _spacing(places: Array) -> float:
    """Smallest distance of two different places; 1 if there is one only."""
    steps = np.diff(np.unique(places))
    return float(steps.min()) if len(steps) else 1.0
