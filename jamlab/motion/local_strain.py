"""Local strain and D2min between two states: the best affine map around each particle, and the motion that it leaves.

Source: M. L. Falk & J. S. Langer, Phys. Rev. E 57, 7192 (1998), eqs 2.11 to 2.13.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array, Indices, Mask
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.geometry.contact_network import contacts
from jamlab.motion.best_map import best_maps
from jamlab.motion.between_states import (
    Run,
    at_rest,
    between_states,
    check_same_particles,
    flow_strain,
    neighbors_of,
    states_of,
)
from jamlab.packing.magnitudes import ROUNDING
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.plotting.drawable import CELL, LEGEND, drawn, in_unit, label_axes, merged_line
from jamlab.plotting.palette import BLUE, RED

_SHOWN = 1e-4  # smallest D2min over the largest that the scale of colours resolves


@dataclass(frozen=True, eq=False)
class LocalStrain(Result):
    """Local strain of n particles between two states.

    Attributes:
        d2min: (n,) squared residual of the best affine map, summed over the neighbours, squared lengths.
        strain: (n, 2, 2) strain[i, a, b] = d u_a / d x_b of the best affine map, that is F - 1, with the strain of the
            box and with rotation. Both are nan where `undefined` says why.
        displacements: (n, 2) motion of each particle relative to the box, without the motion of the whole.
        neighbors: (n,) int64, number of neighbours in the first state.
        undefined: (n,) text, "" where there is a value: "rattler", "flat wall", "too few neighbors" (below 3) or
            "neighbors on a line".
        box_strain: (2, 2) strain of the box, as `strain`. `strain - box_strain` is the non-affine part.
        cutoff: distance within which particles are neighbours, None for neighbours of the tessellation.
        packing: the first state.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> found = jamlab.local_strain(p, jamlab.quasistatic_shear(p, strain=0.01, strain_step=5e-3).packing)
        >>> found.d2min.shape, found.strain.shape, found.box_strain.round(6).tolist()
        ((32,), (32, 2, 2), [[0.0, 0.01], [0.0, 0.0]])
    """

    d2min: Array
    strain: Array
    displacements: Array
    neighbors: Indices
    undefined: NDArray[np.str_]
    box_strain: Array
    cutoff: float | None
    packing: Packing = field(repr=False)

    @property
    def shear(self) -> Array:
        """(n,) local shear strain, sqrt((e_xx - e_yy)^2/4 + (e_xy + e_yx)^2/4): half the shear, whatever its axes."""
        e = self.strain
        return np.asarray(0.5 * np.hypot(e[:, 0, 0] - e[:, 1, 1], e[:, 0, 1] + e[:, 1, 0]))

    @property
    def participation(self) -> float:
        """Number of particles that take part in the non-affine motion, (sum D2min)^2 / sum D2min^2; 0 if no
        particle moves, within rounding."""
        known = self.d2min[np.isfinite(self.d2min)]
        largest = known.max(initial=0.0)
        if not largest > ROUNDING**2 * self.packing.area / self.packing.n:
            return 0.0
        return float((known / largest).sum() ** 2 / ((known / largest) ** 2).sum())

    def _columns(self) -> dict[str, Any]:
        e = self.strain
        parts = {f"strain_{'xy'[a]}{'xy'[b]}": e[:, a, b] for a in (0, 1) for b in (0, 1)}
        beside = {"displacements": self.displacements, "neighbors": self.neighbors, "undefined": self.undefined}
        return {"d2min": self.d2min} | parts | {"shear": self.shear} | beside

    _apart = ("strain",)

    @drawn("PolyCollection", CELL)
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw the first state; particles are coloured by D2min on a logarithmic scale, white without a value.

        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> ax = jamlab.local_strain(p, jamlab.decompress(p, 5e-3)).plot()
        """
        from matplotlib.collections import PolyCollection
        from matplotlib.colors import LogNorm, Normalize

        from jamlab.packing.packing_plot import draw_coloured
        from jamlab.plotting.axes import merged
        from jamlab.plotting.periodic_cell import frame_cell

        largest = float(np.max(self.d2min[np.isfinite(self.d2min)], initial=0.0))
        scale: Normalize = LogNorm(_SHOWN * largest, largest) if largest > 0 else Normalize(0.0, 1.0)
        shown = np.maximum(self.d2min, scale.vmin or 0.0)
        label = in_unit(r"$D^2_{\mathrm{min}}$", _squared(self.packing))
        look = merged(PolyCollection, {"edgecolor": "0.5", "linewidth": 0.4}, style)  # white ones are seen too
        draw_coloured(axes, self.packing, shown, scale, label, **look)
        frame_cell(axes, self.packing.box)


def _squared(packing: Packing) -> str:
    unit = packing.unit_names.length
    return f"{unit}²" if unit else ""


@dataclass(frozen=True, eq=False)
class LocalStrains(Result, Sequence[LocalStrain]):
    """Local strain along a run or a sequence, a `LocalStrain` a step: its items.

    Attributes:
        steps: (m,) local strain of each step.
        states: (m,) int64, number of the state at the end of each step.
        flow_strain: (m,) strain of the flow at the end of each step; nan where states do not carry it.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> run = jamlab.quasistatic_shear(p, strain=0.01, strain_step=5e-3, snapshot_every=5e-3)
        >>> steps = jamlab.local_strain(run)
        >>> len(steps), steps.d2min.shape, steps.flow_strain.tolist()
        (2, (2, 32), [0.005, 0.01])
    """

    _rows = ("states", "flow_strain", "mean", "largest", "participation")

    steps: tuple[LocalStrain, ...] = field(repr=False)
    states: Indices
    flow_strain: Array

    def __len__(self) -> int:
        return len(self.steps)

    @overload
    def __getitem__(self, index: int) -> LocalStrain: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[LocalStrain, ...]: ...
    def __getitem__(self, index: Any) -> Any:
        return self.steps[index]

    def __iter__(self) -> Iterator[LocalStrain]:
        return iter(self.steps)

    @property
    def d2min(self) -> Array:
        """(m, n) D2min of each step."""
        return np.array([each.d2min for each in self.steps])

    @property
    def strain(self) -> Array:
        """(m, n, 2, 2) local strain of each step."""
        return np.array([each.strain for each in self.steps])

    @property
    def mean(self) -> Array:
        """(m,) mean D2min over particles that have one; nan where none has."""
        known = [each.d2min[np.isfinite(each.d2min)] for each in self.steps]
        return np.array([values.mean() if len(values) else np.nan for values in known])

    @property
    def largest(self) -> Array:
        """(m,) largest D2min."""
        known = [each.d2min[np.isfinite(each.d2min)] for each in self.steps]
        return np.array([values.max() if len(values) else np.nan for values in known])

    @property
    def participation(self) -> Array:
        """(m,) number of particles that take part in each step, see `LocalStrain.participation`."""
        return np.array([each.participation for each in self.steps])

    @drawn('Line2D of the mean, such as color="k"')
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw mean and largest D2min over the strain of the flow, or over the number of the state."""
        strained = bool(np.isfinite(self.flow_strain).all())
        x = self.flow_strain if strained else self.states
        plain = {"color": BLUE, "marker": "o", "markersize": 4, "label": "mean"}
        axes.plot(x, self.mean, **merged_line(plain, style))
        axes.plot(x, self.largest, ".", color=RED, label="largest")
        if (self.mean > 0).any():
            axes.set_yscale("log")
        name = r"strain $\gamma$" if strained else "number of the state"
        label_axes(axes, name, in_unit(r"$D^2_{\mathrm{min}}$", _squared(self.steps[0].packing)))
        axes.legend(fontsize=LEGEND)


@overload
def local_strain(
    before: Packing, after: Packing, cutoff: float | None = None, *, rattlers: bool | None = None
) -> LocalStrain: ...
@overload
def local_strain(
    before: Packing, after: Run | Iterable[Packing], cutoff: float | None = None, *, rattlers: bool | None = None
) -> LocalStrains: ...
@overload
def local_strain(
    before: Run | Iterable[Packing],
    after: None = None,
    cutoff: float | None = None,
    *,
    rattlers: bool | None = None,
) -> LocalStrains: ...
@checked
def local_strain(
    before: Packing | Run | Iterable[Packing],
    after: Packing | Run | Iterable[Packing] | None = None,
    cutoff: float | None = None,
    *,
    rattlers: bool | None = None,
) -> Any:
    """Compute local strain and D2min of every particle between states.

    Particles are disks at their centres or droplets at their area centroids. Vectors to neighbours go from one state to
    the next at the image nearest to the affine motion of the box, so that tilted, flipped and strained boxes and
    wrapped particles need nothing. Of two boxes far apart the smallest strain is taken, or the strain of the run, which
    counts from its start, such as the end of the run before.

    Args:
        before: the first state; or, without `after`, a run or packings one after the other, for every step from one
            packing to the next.
        after: the second state of the same particles; or a run or packings, each compared with `before`.
        cutoff: largest distance of neighbours, centre to centre in the first state, unit of length of the packing.
            Default: particles whose cells of `jamlab.tessellation` share a wall.
        rattlers: whether rattlers of either state have values and count as neighbours. Default: False between energy
            minima, where no force determines their positions; True otherwise, as in flow.

    Returns:
        `LocalStrain` of two states, `LocalStrains` of several. Fixed particles are included, flat walls are not.

    Raises:
        InputError: states of other particles, models or units, fewer than two, or a cutoff that is not above 0.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> moved = p.with_state(box=1.1 * p.box, positions=1.1 * p.positions)  # affine
        >>> found = jamlab.local_strain(p, moved, cutoff=1.5)
        >>> bool(np.nanmax(found.d2min) < 1e-25), found.strain[0].diagonal().round(6).tolist()
        (True, [0.1, 0.1])
    """
    if isinstance(before, Packing):
        if after is None:
            raise InputError("after is missing: give the second state, or packings one after the other as before")
        if isinstance(after, Packing):
            check_same_particles(before, after, "after")
            return _between_two(before, after, cutoff, rattlers)
        states = states_of(after, "after", least=1)
        check_same_particles(before, states[0], "state 0 of after")
        return _along([(before, each) for each in states], 0, cutoff, rattlers)
    if after is not None:
        raise InputError("before holds several states, and after is given too: give one packing as before")
    return _along(list(pairwise(states_of(before, "before"))), 1, cutoff, rattlers)


def _along(
    pairs: list[tuple[Packing, Packing]], first: int, cutoff: float | None, rattlers: bool | None
) -> LocalStrains:
    steps = tuple(_between_two(*pair, cutoff, rattlers) for pair in pairs)
    strains = [flow_strain(after) for _, after in pairs]
    return LocalStrains(steps, np.arange(first, first + len(steps)), np.array(strains))


def _between_two(before: Packing, after: Packing, cutoff: float | None, rattlers: bool | None) -> LocalStrain:
    kept = _counted(before, after, rattlers)
    found = between_states(before, after)
    pairs = neighbors_of(before, cutoff, kept)
    maps = best_maps(before.n, pairs.i, pairs.r, found.of_pairs(pairs, before, after))
    undefined = np.where(kept, maps.undefined, np.where(before.flat_walls, "flat wall", "rattler"))
    box_strain = found.gradient - np.eye(2)
    return LocalStrain(
        maps.left, box_strain + maps.change, found.displacements, maps.neighbors, undefined, box_strain, cutoff, before
    )


def _counted(before: Packing, after: Packing, rattlers: bool | None) -> Mask:
    """(n,) which particles have a value and count as neighbours."""
    kept = ~before.flat_walls
    if not (rattlers if rattlers is not None else not at_rest([before, after])):
        kept = kept & ~contacts(before).rattlers & ~contacts(after).rattlers
    return np.asarray(kept)
