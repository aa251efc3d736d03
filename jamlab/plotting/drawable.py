"""Results that draw themselves: one decorator gives every `plot` its axes, its errors and the common docstring."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from inspect import cleandoc
from typing import TYPE_CHECKING, Any, Concatenate, ParamSpec, TypeVar

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CURVES, CELL = (6.4, 4.6), (6.2, 6.4)  # inches of a new figure: of curves, of a periodic cell

_Result = TypeVar("_Result")
_Style = ParamSpec("_Style")
_ARGUMENTS = """
Args:
    ax: matplotlib Axes; by default those of a new figure.
    style: of matplotlib's {artist}.

Returns:
    The axes.

Raises:
    InputError: {raises}`ax` is something else, or matplotlib refuses the style.
"""


def drawn(
    artist: str, size: tuple[float, float] = CURVES, raises: str = ""
) -> Callable[[Callable[Concatenate[_Result, Any, _Style], None]], Callable[..., Axes]]:
    """Make a method `plot(self, axes, **style)` that draws into axes the public `plot(self, ax=None, **style)`.

    The method's docstring says what is drawn and gives an example; what all have in common is added to it.

    Args:
        artist: of matplotlib that takes the style, in words for the docstring.
        size: of a new figure, inches.
        raises: what else is refused, in words that end in a comma.
    """

    def decorate(draw: Callable[Concatenate[_Result, Any, _Style], None]) -> Callable[..., Axes]:
        @wraps(draw)
        def plot(self: _Result, ax: Any = None, **style: Any) -> Axes:
            from jamlab.plotting.axes import axes_for

            with axes_for(ax, style, size) as axes:
                draw(self, axes, **style)  # type: ignore[call-arg]
            return axes

        plot.__doc__ = cleandoc(draw.__doc__ or "") + "\n" + _ARGUMENTS.format(artist=artist, raises=raises)
        return plot

    return decorate
