"""T1 events: two neighbours part, and the two that stood beside both of them meet.

Source: D. Weaire & S. Hutzler, The Physics of Foams (Oxford, 1999).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from jamlab.arrays import Array, Indices
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.geometry.tessellation import tessellation
from jamlab.motion.between_states import Run, states_of
from jamlab.packing.neighbors import shortest_images
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.plotting.drawable import LEGEND, drawn, label_axes, merged_line
from jamlab.plotting.palette import BLUE
from jamlab.statistics.rows_of_one_kind import DataFrame

TRACKED = ("frame", "particle", "x", "y")  # columns of tracks, as trackpy names them
_LONGEST = 1.6  # median edges: a longer edge of the triangulation runs along the border or over a gap
_Pairs = set[tuple[int, int]]


@dataclass(frozen=True, eq=False)
class T1Events(Result):
    """T1 events along a run or through pictures.

    Attributes:
        state: (m,) int64, number of the state, or the frame, in which the event is first seen.
        parted_i, parted_j: (m,) int64, particles that were neighbours before.
        met_i, met_j: (m,) int64, particles that are neighbours after; each was and is one of both that parted.
        place: (m, 2) mean of the four centres after the event.
        steps: (k,) int64, every state that was compared with the one before.
        gained, lost: (k,) int64, pairs of neighbours that met and parted in each step, those of T1 events too.

    Example:
        >>> import pandas as pd
        >>> before = [(0.0, 1.0), (2.0, 1.0), (1.0, 0.0), (1.0, 2.5)]
        >>> after = [(-0.5, 1.0), (2.5, 1.0), (1.0, 0.5), (1.0, 1.5)]
        >>> rows = [(t, k, x, y) for t, places in enumerate((before, after)) for k, (x, y) in enumerate(places)]
        >>> found = jamlab.t1_events(pd.DataFrame(rows, columns=["frame", "particle", "x", "y"]))
        >>> found.state.tolist(), found.parted_i.tolist(), found.parted_j.tolist(), found.met_i.tolist()
        ([1], [0], [1], [2])
    """

    _rows = ("state", "parted_i", "parted_j", "met_i", "met_j", "place")
    _apart = ("steps", "gained", "lost")

    state: Indices
    parted_i: Indices
    parted_j: Indices
    met_i: Indices
    met_j: Indices
    place: Array
    steps: Indices
    gained: Indices
    lost: Indices

    def __len__(self) -> int:
        return len(self.state)

    @property
    def counts(self) -> Indices:
        """(k,) number of events in each step."""
        return np.array([int((self.state == step).sum()) for step in self.steps], dtype=np.int64)

    @drawn("Line2D")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw the number of events up to each state."""
        plain = {"color": BLUE, "drawstyle": "steps-post", "label": f"{len(self)} T1 events"}
        axes.plot(self.steps, np.cumsum(self.counts), **merged_line(plain, style))
        label_axes(axes, "state", "T1 events so far")
        axes.legend(fontsize=LEGEND)


@checked
def t1_events(run: Run | Iterable[Packing] | DataFrame) -> T1Events:
    """Find T1 events between successive states of packings or of tracked droplets.

    In an event one pair of neighbours parts and another pair meets; each particle of one pair is a neighbour of both
    particles of the other pair. Several changes around one particle can hide events: choose states close together.

    Args:
        run: a run with stored packings or packings one after the other; or a table of tracks with the columns frame,
            particle, x and y, such as `jamlab.track_droplets` and trackpy return. Neighbours in packings: cells of
            `jamlab.tessellation` share a wall. In tracks: bonds of the Delaunay triangulation of droplets in both
            frames, up to 1.6 times their median length.

    Raises:
        InputError: fewer than two states, boxes so small that a pair of particles meets twice, or a table without these
            columns, with one frame, with a particle twice in a frame, or with numbers that are not whole.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> run = jamlab.quasistatic_shear(p, strain=0.2, strain_step=1e-2, snapshot_every=1e-2)
        >>> found = jamlab.t1_events(run)
        >>> len(found.steps), bool((found.gained.sum() >= len(found)))
        (20, True)
    """
    named = list(_of_tracks(run) if isinstance(run, DataFrame) else _of_packings(states_of(run, "run")))
    rows: list[tuple[int, ...]] = []
    places, gained, lost = [], [], []
    for number, old, new, centre in named:
        swaps = find_swaps(old, new)
        rows += [(number, *swap) for swap in swaps]
        places += [centre(swap) for swap in swaps]
        gained.append(len(new - old))
        lost.append(len(old - new))
    state, parted_i, parted_j, met_i, met_j = np.array(rows, dtype=np.int64).reshape(-1, 5).T
    steps, more, fewer = (np.array(values, dtype=np.int64) for values in ([each[0] for each in named], gained, lost))
    return T1Events(state, parted_i, parted_j, met_i, met_j, np.array(places).reshape(-1, 2), steps, more, fewer)


def find_swaps(old: _Pairs, new: _Pairs) -> list[tuple[int, int, int, int]]:
    """T1 events between two sets of neighbours i < j: the pair that parts, and the one that meets."""
    kept, met = _around(old & new), new - old
    found = []
    for a, b in sorted(old - new):
        beside = sorted(kept.get(a, set()) & kept.get(b, set()))
        found += [(a, b, c, d) for k, c in enumerate(beside) for d in beside[k + 1 :] if (c, d) in met]
    return found


def _around(pairs: _Pairs) -> dict[int, set[int]]:
    found: dict[int, set[int]] = {}
    for a, b in pairs:
        found.setdefault(a, set()).add(b)
        found.setdefault(b, set()).add(a)
    return found


def _of_packings(states: list[Packing]) -> Iterator[tuple[int, _Pairs, _Pairs, Any]]:
    """Number, neighbours before and after, and where the middle of four particles is, of each state."""
    pairs = [_neighbors(each, number) for number, each in enumerate(states)]
    for number, (old, new) in enumerate(pairwise(pairs), start=1):
        yield number, old, new, partial(_middle_in_box, states[number])


def _neighbors(packing: Packing, number: int) -> _Pairs:
    cells = tessellation(packing)
    whole = ~packing.flat_walls[cells.wall_i] & ~packing.flat_walls[cells.wall_j]
    i, j = cells.wall_i[whole], cells.wall_j[whole]
    found = set(zip(i.tolist(), j.tolist(), strict=True))
    if len(found) < len(i) or (i == j).any():
        raise InputError(
            f"state {number} of run: a pair of particles, n = {packing.n}, meets across the box and within it: T1 "
            "events need a larger packing, of a box several particles wide"
        )
    return found


def _middle_in_box(packing: Packing, swap: Iterable[int]) -> Array:
    x = packing.centroids[list(swap)]
    apart = x - x[0]
    return np.asarray(x[0] + (apart - shortest_images(apart, packing.box) @ packing.box).mean(axis=0))


# tracks ---------------------------------------------------------------------------------------------------------------


def checked_tracks(table: Any) -> Any:
    """The table in the order of frames and particles; refused unless it is one of tracks."""
    missing = [name for name in TRACKED if name not in getattr(table, "columns", ())]
    if missing:
        raise InputError(f"run: the table has no column {missing[0]!r}: give tracks with {', '.join(TRACKED)}")
    numbers = [getattr(table[name].dtype, "kind", "O") in "iuf" for name in TRACKED]  # whole ones with gaps too
    values = table[[*TRACKED]].astype(np.float64) if all(numbers) else None
    if values is None or not np.isfinite(values.to_numpy()).all():
        raise InputError("run: frame, particle, x and y of tracks must be finite numbers: drop the other rows")
    for name in ("frame", "particle"):
        if (broken := np.flatnonzero(values[name] % 1 != 0)).size:
            value = values[name].iloc[broken[0]]
            raise InputError(f"run: {name} = {value:g} in row {broken[0]} of tracks: must be a whole number")
    table = table.assign(**values).reset_index(drop=True)  # trackpy names the index frame too
    if table["frame"].nunique() < 2:
        raise InputError(f"run: the tracks have {table['frame'].nunique()} frame(s): give two or more")
    if (twice := table.duplicated(["frame", "particle"])).any():
        row = table[twice].iloc[0]
        raise InputError(f"run: particle {row['particle']:g} is twice in frame {row['frame']:g}: number it anew")
    return table.sort_values(["frame", "particle"])


def _of_tracks(table: Any) -> Iterator[tuple[int, _Pairs, _Pairs, Any]]:
    """As `_of_packings`, of droplets that are in both frames."""
    frames = [rows for _, rows in checked_tracks(table).groupby("frame")]
    for before, now in pairwise(frames):
        old, new = common_places(before, now)
        names = np.intersect1d(before["particle"], now["particle"]).astype(np.int64)
        place = dict(zip(names.tolist(), new, strict=True))
        pairs = _named(names, bonds(old)), _named(names, bonds(new))
        yield int(now["frame"].iloc[0]), *pairs, partial(_middle, place)


def _middle(place: dict[int, Array], swap: Iterable[int]) -> Array:
    return np.asarray(np.mean([place[k] for k in swap], axis=0))


def common_places(before: Any, now: Any) -> tuple[Array, Array]:
    """(m, 2) places before and after of the droplets that are in both of two frames, by number."""
    _, first, second = np.intersect1d(before["particle"], now["particle"], return_indices=True)
    old, new = (rows[["x", "y"]].to_numpy(np.float64) for rows in (before, now))
    return old[first], new[second]


def bonds(places: Array) -> Indices:
    """(m, 2) pairs of neighbours i < j: bonds of the Delaunay triangulation that are not long; none of points on a line
    or fewer than three."""
    from scipy.spatial import Delaunay, QhullError

    try:
        corners = Delaunay(places).simplices if len(places) > 2 else np.zeros((0, 3), dtype=np.int64)
    except QhullError:
        corners = np.zeros((0, 3), dtype=np.int64)
    sides = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    edges = np.unique(np.sort(sides, axis=1), axis=0).astype(np.int64)
    if not len(edges):
        return edges
    length = np.hypot(*(places[edges[:, 0]] - places[edges[:, 1]]).T)
    return np.asarray(edges[length <= _LONGEST * np.median(length)])


def _named(names: Indices, edges: Indices) -> _Pairs:
    return {(min(pair), max(pair)) for pair in names[edges].tolist()}
