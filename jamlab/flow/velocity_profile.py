"""Velocity across a flow: mean motion along x of particles at each height, and how much of the shear is localised."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.packing.natural_units import mean_size
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.plotting.drawable import LEGEND, drawn, label_axes, merged_line
from jamlab.plotting.palette import BLACK, BLUE


@dataclass(frozen=True)
class VelocityProfile(Result):
    """Velocity profile of a flow in layers from the bottom up; between walls of the free particles only.

    Attributes:
        height: (m,) mean height of the particles of each layer, over the height of the cell.
        velocity: (m,) mean displacement along x per strain of the cell, over the height of the cell: an affine flow has
            `height`. nan of a layer without particles.
        standard_error: (m,) of it, from the parts of the run between two packings, which are taken for independent;
            of few parts a 95 % interval is wider than 1.96 times this, by Student's t. nan of one part.
    """

    _rows = ("height", "velocity", "standard_error")

    height: Array
    velocity: Array
    standard_error: Array

    @property
    def local_rate(self) -> Array:
        """(m - 1,) shear rate between layers, over the shear rate of the cell."""
        return np.asarray(np.diff(self.velocity) / np.diff(self.height))

    @property
    def localisation(self) -> float:
        """Mean square of the local rate over the square of its mean: 1 where all layers shear alike, m - 1 where all
        the shear is between two of them."""
        rate = self.local_rate[np.isfinite(self.local_rate)]
        return float(np.mean(rate**2) / np.mean(rate) ** 2)

    @drawn("Line2D")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw velocity against height; dashed: an affine flow."""
        plain = {"color": BLUE, "marker": "o", "markersize": 4, "label": f"localisation {self.localisation:.3g}"}
        axes.plot(self.height, self.velocity, **merged_line(plain, style))
        axes.plot([0, 1], [0, 1], color=BLACK, linestyle="--", linewidth=0.8)
        label_axes(axes, "height / cell height", "velocity / velocity of the upper edge")
        axes.legend(fontsize=LEGEND)


def velocity_profile(frames: Sequence[Packing]) -> VelocityProfile:
    """The profile between packings that a run has kept, in layers of about one mean size. `frames`: two or more."""
    if len(frames) < 2:
        raise InputError(f"{len(frames)} stored packing: a profile needs two or more; shear with snapshot_every=")
    first = frames[0]
    free, lattice = first.frame.free, float(first.box[1, 1])
    edges = np.linspace(0.0, 1.0, max(4, round(lattice / mean_size(first))) + 1)
    heights: list[Array] = []
    parts: list[Array] = []
    for before, after in pairwise(frames):
        strain = after.provenance["flow_strain"] - before.provenance["flow_strain"]
        if strain == 0:
            continue  # the ends of a cycle, which tell no velocity
        start, end = before.centroids[free], after.centroids[free]
        middle = 0.5 * (start[:, 1] / before.box[1, 1] + end[:, 1] / after.box[1, 1])
        inside = middle % 1.0
        velocity = (end - start)[:, 0] / (strain * lattice) - (middle - inside)
        heights.append(_layer_means(inside, inside, edges))
        parts.append(_layer_means(inside, velocity, edges))
    if not parts:
        raise InputError(f"{len(frames)} stored packings at one strain: shear with snapshot_every=")
    kept = np.isfinite(parts).any(axis=0)
    found = np.array(parts)[:, kept]
    number = np.isfinite(found).sum(axis=0)
    spread = np.nanstd(found, axis=0) / np.sqrt(np.maximum(number - 1, 1))
    error = np.where(number > 1, spread, np.nan)
    return VelocityProfile(np.nanmean(np.array(heights)[:, kept], axis=0), np.nanmean(found, axis=0), error)


def _layer_means(height: Array, values: Array, edges: Array) -> Array:
    """Mean of the values in each layer between edges; nan where there are none."""
    layers = len(edges) - 1
    layer = np.minimum(np.searchsorted(edges, height, "right") - 1, layers - 1)
    count, total = np.bincount(layer, minlength=layers), np.bincount(layer, values, layers)
    return np.asarray(np.divide(total, count, out=np.full(layers, np.nan), where=count > 0))
