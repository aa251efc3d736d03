"""Axes to draw into, given or new; the caller's style over defaults."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from matplotlib.axes import Axes
from matplotlib.cbook import normalize_kwargs

from jamlab.errors import InputError, JamlabError


@contextmanager
def axes_for(ax: Any, style: Mapping[str, Any], size: tuple[float, float]) -> Iterator[Axes]:
    """Give the axes of the caller, or axes of a new pyplot figure of a size in inches, as notebooks show them; it
    is closed again if nothing could be drawn. An error names what matplotlib refuses of the style."""
    figure = None
    if ax is None:
        from matplotlib import pyplot

        figure, ax = pyplot.subplots(figsize=size, layout="constrained")
    elif not isinstance(ax, Axes) or ax.name != "rectilinear":  # polar and 3D axes cannot show these
        raise InputError(f"ax = {ax!r:.80} ({type(ax).__name__}): give matplotlib Axes, plain, or None for new ones")
    try:
        yield ax
    except Exception as error:
        if figure is not None:
            pyplot.close(figure)
        if style and isinstance(error, AttributeError | TypeError | ValueError) and not isinstance(error, JamlabError):
            given = ", ".join(f"{name} = {value!r:.40}" for name, value in style.items())
            raise InputError(f"matplotlib refuses the style {given}: {error}") from error
        raise


def merged(artist: Any, defaults: Mapping[str, Any], style: Mapping[str, Any]) -> dict[str, Any]:
    """Take the caller's style over the defaults; short names such as lw and c mean what they do in matplotlib."""
    own = normalize_kwargs(dict(style), artist)
    if "colors" in own:  # LineCollection has this name besides
        own["color"] = own.pop("colors")
    if "color" in own:  # of a collection: both, so neither default may stay
        defaults = {name: value for name, value in defaults.items() if name not in ("facecolor", "edgecolor")}
    return {**defaults, **own}


def legend_below(axes: Axes, handles: list[Any], title: str = "") -> None:
    """Put a legend below the axes, where a picture that fills them leaves room for none."""
    axes.legend(
        handles=handles, title=title or None, loc="upper center", bbox_to_anchor=(0.5, -0.01), ncols=6, fontsize=9
    )
