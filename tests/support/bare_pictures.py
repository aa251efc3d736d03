"""Pictures without text, for comparison pixel by pixel, and the stored states that they are drawn from."""

from pathlib import Path

import pytest
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.text import Text
from matplotlib.transforms import Bbox

import jamlab

HERE = Path(__file__).parents[1] / "figures"
SHARP = {"lines.antialiased": False, "patch.antialiased": False, "text.hinting": "none"}
picture = pytest.mark.mpl_image_compare(
    baseline_dir=str(HERE / "baseline"),
    style=["default", SHARP],
    tolerance=2,
    savefig_kwargs={"dpi": 80},
    deterministic=True,
)


def artists(parent, kind):
    """All artists of a kind inside another, but ticks and their labels: `findobj` makes hundreds of them to look."""
    children = [child for child in parent.get_children() if not isinstance(child, Axis)]
    return [found for child in children for found in [child] * isinstance(child, kind) + artists(child, kind)]


def covers_points(figure):
    """Whether a legend lies over a point of a line within its axes."""
    figure.draw_without_rendering()
    legends = [legend.get_window_extent() for legend in artists(figure, Legend)]
    lines = [(a.bbox, line.get_transform().transform(line.get_xydata())) for a in figure.axes for line in a.lines]
    covered = [(Bbox.intersection(legend, view), points) for legend in legends for view, points in lines]
    return any(part is not None and part.count_contains(points) for part, points in covered)


def bare(figure, columns=1):
    """The figure without text, ticks and grid lines, its panels in a row."""
    figure.set_layout_engine("none")
    scales = [axes for axes in figure.axes if axes.get_label() == "<colorbar>"]
    panels = [axes for axes in figure.axes if axes not in scales]
    for group, left, width in ((panels, 0.06, 0.84), (scales, 0.93, 0.03)):
        for k, axes in enumerate(group):
            axes.set_position([(k + left) / columns, 0.14, width / columns, 0.8])
    for text in artists(figure, Text):
        text.set(text="", fontsize=0.1)  # else the height of an empty line moves legends
    for axes in figure.axes:
        axes.xaxis.set_visible(False)
        axes.yaxis.set_visible(False)
    return figure


def state(name):
    return jamlab.read(HERE / "states" / f"{name}.h5")


def both(draw, width=7.0, height=3.6):
    """The two models side by side, small."""
    figure = Figure(figsize=(width, height), layout="constrained")
    for axes, name in zip(figure.subplots(1, 2), ("disks", "droplets"), strict=True):
        draw(axes, state(name), name)
    return bare(figure, columns=2)
