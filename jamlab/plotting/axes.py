"""Axes to draw into, given or new; the caller's style over defaults."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from itertools import product
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cbook import normalize_kwargs
from matplotlib.figure import Figure

from jamlab.errors import InputError, JamlabError

LEAST_FONT = 5.0  # points


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
        if figure is not None:
            show_whole(figure)
    except Exception as error:
        if figure is not None:
            pyplot.close(figure)
        if style and isinstance(error, AttributeError | TypeError | ValueError) and not isinstance(error, JamlabError):
            given = ", ".join(f"{name} = {value!r:.40}" for name, value in style.items())
            raise InputError(f"matplotlib refuses the style {given}: {error}") from error
        raise


def show_whole(figure: Figure) -> None:
    """Make a figure as much larger as titles, legends and labels stick out of it, so that a saved file shows all.

    The layout of matplotlib leaves too little room around axes of equal scales: it measures before it shrinks them.
    """
    figure.draw_without_rendering()
    size = figure.get_size_inches()
    drawn = figure.get_tightbbox().padded(0.04)  # inches around all that is drawn
    low, high = np.maximum(-np.array(drawn.min), 0.0), np.maximum(np.array(drawn.max) - size, 0.0)
    if not (low.any() or high.any()):
        return
    boxes = [np.reshape(axes.get_position().extents, (2, 2)) * size + low for axes in figure.axes]
    figure.set_layout_engine("none")
    size = size + low + high
    figure.set_size_inches(size)
    for axes, box in zip(figure.axes, boxes, strict=True):
        (left, bottom), (right, top) = box / size
        axes.set_position((left, bottom, right - left, top - bottom))


def fit_title(axes: Axes) -> None:
    """Make a title smaller until it is as wide as its axes and ends below the edge of the figure."""
    room, title = axes.get_window_extent(), axes.title
    for size in np.arange(float(title.get_fontsize()), LEAST_FONT, -0.5):
        title.set_fontsize(size)
        box = title.get_window_extent()
        if box.width <= room.width and box.height <= axes.figure.bbox.y1 - room.y1:
            break


def merged(artist: Any, defaults: Mapping[str, Any], style: Mapping[str, Any]) -> dict[str, Any]:
    """Take the caller's style over the defaults; short names such as lw and c mean what they do in matplotlib."""
    own = normalize_kwargs(dict(style), artist)
    if "colors" in own:  # LineCollection has this name besides
        own["color"] = own.pop("colors")
    if "color" in own:  # of a collection: both, so neither default may stay
        defaults = {name: value for name, value in defaults.items() if name not in ("facecolor", "edgecolor")}
    return {**defaults, **own}


def legend_below(axes: Axes, handles: list[Any], title: str = "", **style: Any) -> None:
    """Put a legend below the axes, where a picture that fills them leaves room for none, as large as fits there."""
    place: dict[str, Any] = {"handles": handles, "loc": "upper center", "bbox_to_anchor": (0.5, -0.01)}
    place |= {"title": title or None} | style
    wide, laid_out, place_in = axes.get_window_extent().width, axes.figure.get_layout_engine(), axes.get_subplotspec()
    if laid_out and place_in:  # axes grow until they fill their share of the figure
        wide = axes.figure.bbox.width / place_in.get_gridspec().ncols
    for size, columns in product((9, 7, LEAST_FONT), range(min(len(handles), 6), 0, -1)):
        box = axes.legend(ncols=columns, fontsize=size, **place).get_window_extent()
        if box.width <= wide and (laid_out or box.y0 >= 0):
            break
