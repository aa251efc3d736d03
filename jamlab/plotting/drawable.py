"""Results that draw themselves: one decorator gives every `plot` its axes, its errors and the common docstring.

What a `plot` method needs besides, labels and style, stands here too. Nothing imports matplotlib before it draws.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import wraps
from inspect import Parameter, Signature, cleandoc, signature
from typing import TYPE_CHECKING, Any, Protocol, cast, overload

import numpy as np

from jamlab.arrays import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    class DrawnAxes(Axes):
        """Axes of a figure of their own, which `plot` makes where it is given none."""

        @property
        def figure(self) -> Figure: ...


CURVES, CELL = (6.4, 4.6), (6.2, 6.4)  # inches of a new figure: of curves, of a periodic cell
LABEL, TICK, LEGEND = 12, 11, 10  # points

_ARGUMENTS = """
Args:
    ax: matplotlib Axes (default: a new figure).
    style: of matplotlib's {artist}.

Returns:
    The axes.

Raises:
    InputError: {raises}`ax` is something else, or matplotlib refuses the style.
"""


class Plot(Protocol):
    """The method `plot` of a result."""

    @overload
    def __call__(self, ax: None = None, **style: Any) -> DrawnAxes: ...
    @overload
    def __call__(self, ax: Axes, **style: Any) -> Axes: ...


def drawn(artist: str, size: tuple[float, float] = CURVES, raises: str = "") -> Callable[[Callable[..., None]], Plot]:
    """Make a method `plot(self, axes, /, **style)` that draws into axes the public `plot(self, ax=None, **style)`. To
    its docstring, which says what is drawn, what all have in common is added; `artist` takes the
    style."""

    def decorate(draw: Callable[..., None]) -> Plot:
        @wraps(draw)
        def plot(self: Any, ax: Any = None, **style: Any) -> Axes:
            from jamlab.plotting.axes import axes_for

            with axes_for(ax, style, size) as axes:
                draw(self, axes, **style)
            return axes

        own, _, *rest = signature(draw).parameters.values()
        ax = Parameter("ax", Parameter.POSITIONAL_OR_KEYWORD, default=None, annotation=Any)
        own = own.replace(kind=Parameter.POSITIONAL_OR_KEYWORD)
        plot.__signature__ = Signature([own, ax, *rest])  # type: ignore[attr-defined]
        plot.__doc__ = cleandoc(draw.__doc__ or "") + "\n" + _ARGUMENTS.format(artist=artist, raises=raises)
        return cast(Plot, plot)  # a function of the class, which its objects call without themselves

    return decorate


def merged_line(defaults: Mapping[str, Any], style: Mapping[str, Any]) -> dict[str, Any]:
    """Take the caller's style of a Line2D over the defaults; see `jamlab.plotting.axes.merged`."""
    from matplotlib.lines import Line2D

    from jamlab.plotting.axes import merged

    return merged(Line2D, defaults, style)


def label_axes(axes: Any, x: str, y: str) -> None:
    """Name both axes, with their units, at a legible size, over a light grid."""
    axes.set_xlabel(x, fontsize=LABEL)
    axes.set_ylabel(y, fontsize=LABEL)
    axes.tick_params(labelsize=TICK)
    axes.grid(alpha=0.3, which="major")
    axes.set_axisbelow(True)


def label_decades(axes: Any) -> None:
    """Label 1, 2 and 5 of each decade of logarithmic axes that span few of them, where more labels would overlap."""
    from matplotlib.ticker import LogLocator, StrMethodFormatter

    for axis in (axes.xaxis, axes.yaxis):
        low, high = axis.get_view_interval()
        if high <= 100 * low:
            axis.set_minor_locator(LogLocator(subs=(2, 5)))
            axis.set_minor_formatter(StrMethodFormatter("{x:g}"))
            axis.set_major_formatter(StrMethodFormatter("{x:g}"))


def in_unit(text: str, unit: str) -> str:
    """Add a unit in brackets to a label; nothing where none is known."""
    return f"{text}  [{unit}]" if unit else text


def positive(values: Array) -> tuple[Array, str]:
    """Values with nan where a logarithm has none, and how a legend says so; "" if all are positive."""
    shown = values > 0
    return np.where(shown, values, np.nan), "" if shown.all() else f", {np.sum(~shown)} value(s) not above 0 left out"
