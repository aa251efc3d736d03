"""Draw shapes and lines in a periodic parallelogram: every image that reaches into the picture, and the cell's outline.

Pictures show the cell and a margin around it, so that what lies on the boundary is seen whole.
"""

from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection

from jamlab.arrays import Array
from jamlab.plotting.axes import merged

MARGIN = 0.045  # around the cell, over the root of its area: a third of a particle where there are 64


def lattice_moves(box: Array) -> Array:
    """(m, 2) translations of the cell to itself, in the middle, and to all images that reach into the picture. Nine in
    a box that is not tilted further than it is wide; a cell that leans more needs more images beside it."""
    aside = 1 + max(0, int(np.ceil((abs(box[1, 0]) + _margin(box)) / box[0, 0] - 1)))
    return np.asarray(np.array(list(product(range(-aside, aside + 1), (-1, 0, 1)))) @ box)


def _margin(box: Array) -> float:
    return MARGIN * float(np.sqrt(abs(np.linalg.det(box))))


def circles(centres: Array, diameters: Array) -> list[Array]:
    """Closed ring of each disk."""
    turn = 2 * np.pi * np.arange(48 + 1) / 48  # corners of a drawn disk: a circle to the eye at this size
    circle = np.column_stack([np.cos(turn), np.sin(turn)])
    return [x + 0.5 * d * circle for x, d in zip(centres, diameters, strict=True)]


def fill_everywhere(axes: Axes, rings: Sequence[Array], box: Array, /, **style: Any) -> None:
    """Fill rings in the cell and all its images; style of matplotlib's PolyCollection, one colour a ring."""
    look = merged(PolyCollection, {}, style)
    for move in lattice_moves(box):
        axes.add_collection(PolyCollection([ring + move for ring in rings], **look))


def line_everywhere(axes: Axes, lines: Sequence[Array] | Array, box: Array, /, **style: Any) -> None:
    """Draw lines in the cell and all its images; style of matplotlib's LineCollection, one width a line."""
    look = merged(LineCollection, {}, style)
    for move in lattice_moves(box):
        axes.add_collection(LineCollection([line + move for line in lines], **look))


def frame_cell(axes: Axes, box: Array) -> None:
    """Draw the outline of the periodic cell, set limits with a margin around it, and remove ticks."""
    corner = box.sum(axis=0)
    cell = np.array([[0, 0], box[0], corner, box[1], [0, 0]])
    axes.plot(*cell.T, color="black", linewidth=1.4)
    margin = _margin(box)
    axes.set_xlim(min(0, box[1, 0]) - margin, max(corner[0], box[0, 0]) + margin)
    axes.set_ylim(-margin, corner[1] + margin)
    axes.set_aspect("equal")
    axes.set_xticks([])
    axes.set_yticks([])
