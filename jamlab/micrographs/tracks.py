"""Droplets followed through pictures: tracks, neighbours gained and lost, T1 events, local strain and D2min.

Droplets of two pictures are matched so that squared displacements sum up to least; none goes further than half the
spacing. With a memory, one that is missed keeps its number and is sought where it was seen last. Neighbours are those
of the Delaunay triangulation of centres, without edges longer than `LONGEST` spacings. In a T1 event a pair parts and
the two that stood beside both of them meet.

The strain at a droplet is the symmetric part of F - 1, with F the linear map that takes vectors to its neighbours from
one picture to the next with the least squares; what is left, per neighbour, is D2min.

Sources: M. L. Falk & J. S. Langer, Phys. Rev. E 57, 7192 (1998), for D2min; H. W. Kuhn, Nav. Res. Logist. Q. 2, 83
(1955), for the matching; D. Weaire & S. Hutzler, The Physics of Foams (1999), for T1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import coo_array
from scipy.sparse.csgraph import min_weight_full_bipartite_matching
from scipy.spatial import Delaunay, KDTree, QhullError

from jamlab.arrays import Array, Indices
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.micrographs.micrograph import micrograph
from jamlab.plotting.drawable import drawn, label_axes
from jamlab.plotting.palette import BLUE, RED

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = ("frame", "particle", "x", "y")  # of a track table, as trackpy names them
FARTHEST = 0.5  # of the spacing, that a droplet may move from one picture to the next
LONGEST = 1.6  # spacings between neighbours
LEAST_NEIGHBOURS = 3  # for a strain
STRAINS = ("strain_xx", "strain_yy", "strain_xy", "d2min")  # columns that are added


@dataclass(frozen=True)
class Tracks:
    """Droplets of several pictures, followed.

    Attributes:
        table: a row per droplet and picture: frame, particle, x, y, and what else was measured; and, from the picture
            before to this one, strain_xx, strain_yy, strain_xy and d2min (squared lengths), nan without neighbours.
        events: a row per event: frame in which it is first seen, kind ("gained", "lost" or "T1"), a and b, the pair
            that meets or parts; of a T1 c and d, the pair that meets while a and b part.
        spacing: typical distance of neighbours, in the unit of the table.

    Example:
        >>> p = jamlab.jam(model="dp", n=16, seed=1)
        >>> pictures = [jamlab.synthetic_micrograph(p, 300, seed=k, noise=0.02) for k in range(3)]
        >>> tracks = jamlab.track_droplets(pictures, contrast="bright")
        >>> tracks.count, set(tracks.table["frame"]), len(tracks.events)
        (9, {0, 1, 2}, 0)
    """

    table: pd.DataFrame
    events: pd.DataFrame
    spacing: float

    @property
    def count(self) -> int:
        """Number of droplets seen in every picture."""
        frames = self.table["frame"].nunique()
        return int((self.table.groupby("particle")["frame"].nunique() == frames).sum())

    @drawn("LineCollection, of the tracks")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw all tracks, and T1 events as circles."""
        from matplotlib.collections import LineCollection

        look: dict[str, Any] = {"linewidths": 0.8, "color": BLUE} | style
        lines = [rows[["x", "y"]].to_numpy() for _, rows in self.table.sort_values("frame").groupby("particle")]
        axes.add_collection(LineCollection(lines, **look))
        swaps = self.events[self.events["kind"] == "T1"]
        middles = [self._middle(row) for row in swaps.itertuples()]
        if middles:
            axes.plot(*np.array(middles).T, "o", color=RED, fillstyle="none")
        axes.autoscale_view()
        axes.set_aspect("equal")
        axes.invert_yaxis()
        label_axes(axes, "x", "y")

    def _middle(self, row: Any) -> Array:
        now = self.table[(self.table["frame"] == row.frame) & self.table["particle"].isin([row.a, row.b, row.c, row.d])]
        return np.asarray(now[["x", "y"]].mean())


@checked
def track_droplets(source: Any, *, memory: int = 0, **how: Any) -> Tracks:
    """Track droplets through a series of pictures, or use tracks of another program.

    Args:
        source: pictures in the order of time, as for `jamlab.micrograph`; or a track table: CSV file or DataFrame with
            trackpy's columns frame, particle, x and y.
        memory: number of successive pictures in which a droplet may be missing and keep its number.
        how: further arguments of `jamlab.micrograph`, the same for all pictures.

    Raises:
        InputError: fewer than two pictures, a negative memory, an invalid table, or an error of `jamlab.micrograph`.

    Example:
        >>> import pandas as pd
        >>> x, y = np.array([0.0, 4.0, 0.0, 4.0, 2.0]), np.array([0.0, 0.0, 4.0, 4.0, 2.0])
        >>> rows = [(t, k, x[k] + 0.1 * t * y[k], y[k]) for t in range(3) for k in range(5)]
        >>> tracks = jamlab.track_droplets(pd.DataFrame(rows, columns=["frame", "particle", "x", "y"]))
        >>> int(tracks.table["particle"].nunique())
        5
    """
    import pandas as pd

    if memory < 0:
        raise InputError(f"memory is {memory}: must be a number of pictures, 0 or more")
    if isinstance(source, pd.DataFrame):
        return _analyse(_checked_table(source))
    if isinstance(source, str | Path):
        try:
            return _analyse(_checked_table(pd.read_csv(source)))
        except (OSError, ValueError) as error:
            if isinstance(error, InputError):
                raise
            raise InputError(f"{source} cannot be read as a track table: {str(error).splitlines()[0]}") from None
    if not isinstance(source, Sequence) and not (isinstance(source, np.ndarray) and source.ndim):
        raise InputError(f"a {type(source).__name__} is neither a list of pictures nor a track table")
    if len(source) < 2:
        raise InputError(f"{len(source)} pictures: tracking needs two or more")
    return _analyse(_link([micrograph(picture, **how).table() for picture in source], memory))


def _checked_table(table: Any) -> Any:
    missing = [name for name in COLUMNS if name not in table]
    if missing:
        raise InputError(f"the track table has no column {missing[0]!r}: needs {', '.join(COLUMNS)}")
    values = table[[*COLUMNS]].to_numpy()
    if values.dtype.kind not in "iuf" or not np.isfinite(values.astype(np.float64)).all():
        raise InputError("columns frame, particle, x and y of the track table must hold finite numbers")
    if table["frame"].nunique() < 2:
        raise InputError("the track table has one frame: tracking needs two or more")
    if table.duplicated(["frame", "particle"]).any():
        twice = table[table.duplicated(["frame", "particle"])].iloc[0]
        raise InputError(f"particle {twice['particle']:g} is twice in frame {twice['frame']:g}")
    return table.sort_values(["frame", "particle"]).reset_index(drop=True)


def _link(tables: list[Any], memory: int = 0) -> Any:
    """One table of all pictures; the same droplet has the same `particle`, also if it was missed `memory` times."""
    import pandas as pd

    lost = pd.DataFrame()  # droplets seen before, with their last place
    count, linked = 0, []
    for frame, now in enumerate(tables):
        names = np.full(len(now), -1)
        if len(lost):
            reach = FARTHEST * float(np.sqrt(lost.loc[lost["frame"] == frame - 1, "cell"].median()))
            rows, columns = _match(lost[["x", "y"]].to_numpy(), now[["x", "y"]].to_numpy(), reach)
            names[columns] = lost["particle"].to_numpy()[rows]
        fresh = names < 0
        names[fresh] = count + np.arange(fresh.sum())
        count += int(fresh.sum())
        linked.append(now.assign(frame=frame, particle=names))
        lost = pd.concat([lost, linked[-1]]).drop_duplicates("particle", keep="last")
        lost = lost[lost["frame"] >= frame - memory]
    return pd.concat(linked, ignore_index=True)


def _match(old: Array, new: Array, reach: float) -> tuple[Indices, Indices]:
    """Rows of points (n, 2) and of points (m, 2) that belong together: pairs nearer than `reach`, whose squared
    distances and `reach` squared for each of the n left over sum up to least."""
    near = KDTree(old).sparse_distance_matrix(KDTree(new), reach, output_type="ndarray")
    alone, n, m = np.arange(len(old)), len(old), len(new)
    cost = np.concatenate([near["v"] ** 2, np.full(n, reach**2)]) + reach**2  # none is 0, which would be no pair
    ends = np.concatenate([near["i"], alone]), np.concatenate([near["j"], m + alone])
    rows, columns = min_weight_full_bipartite_matching(coo_array((cost, ends), (n, n + m)).tocsr())
    return rows[columns < m], columns[columns < m]


def neighbours(points: ArrayLike) -> tuple[Indices, float]:
    """(m, 2) pairs of neighbours, and the median distance of the edges of the Delaunay triangulation."""
    places = np.asarray(points, dtype=np.float64)
    try:
        triangles = Delaunay(places).simplices
    except (QhullError, ValueError):
        raise InputError(
            f"{len(places)} droplets of a picture lie on a line or are too few to have neighbours"
        ) from None
    edges = np.unique(
        np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])), axis=0
    )
    length = np.hypot(*(places[edges[:, 0]] - places[edges[:, 1]]).T)
    spacing = float(np.median(length))
    return np.asarray(edges[length <= LONGEST * spacing], dtype=np.int64), spacing


def _analyse(table: Any) -> Tracks:
    """Strains and events from each picture to the next."""
    import pandas as pd

    frames = [rows for _, rows in table.groupby("frame")]
    pairs = [neighbours(rows[["x", "y"]]) for rows in frames]
    sets = [
        {tuple(sorted(edge)) for edge in rows["particle"].to_numpy()[edges].tolist()}
        for rows, (edges, _) in zip(frames, pairs, strict=True)
    ]
    strains, events = [np.full((len(frames[0]), 4), np.nan)], []
    for (before, now), (old, new), (edges, _) in zip(pairwise(frames), pairwise(sets), pairs, strict=False):
        strains.append(_strain(before, now, edges))
        both = set(before["particle"]) & set(now["particle"])
        frame = now["frame"].iloc[0]
        gained, lost = ([pair for pair in sorted(part) if both.issuperset(pair)] for part in (new - old, old - new))
        events += [(frame, "gained", *pair, -1, -1) for pair in gained] + [
            (frame, "lost", *pair, -1, -1) for pair in lost
        ]
        events += [(frame, "T1", *pair, *other) for pair in lost for other in gained if _swap(pair, other, old, new)]
    given, columns = pd.concat(frames, ignore_index=True), np.concatenate(strains).T
    for name, own in zip(STRAINS, columns, strict=True):
        if name in given and not np.allclose(given[name], own, equal_nan=True):
            raise InputError(f"the track table has a column {name!r} that differs from the {name} found: rename it")
    full = given.assign(**dict(zip(STRAINS, columns, strict=True)))
    named = pd.DataFrame(events, columns=["frame", "kind", "a", "b", "c", "d"])
    return Tracks(full, named, float(np.median([spacing for _, spacing in pairs])))


def _swap(parted: tuple[int, int], met: tuple[int, int], old: set[Any], new: set[Any]) -> bool:
    """Whether the pair that met stood beside both of the pair that parted, and still does."""
    if set(parted) & set(met):
        return False
    sides = {tuple(sorted((a, c))) for a in parted for c in met}
    return sides <= old and sides <= new


def _strain(before: Any, now: Any, edges: Indices) -> Array:
    """(n, 4) strain xx, yy, xy and D2min of the droplets of `now`, from vectors to neighbours."""
    place = {name: row for row, name in enumerate(now["particle"])}
    old, new = before[["x", "y"]].to_numpy(), now[["x", "y"]].to_numpy()
    target = np.array([place.get(name, -1) for name in before["particle"]])
    found = np.full((len(now), 4), np.nan)
    both = np.concatenate([edges, edges[:, ::-1]])
    both = both[np.argsort(both[:, 0], kind="stable")]
    ends = np.searchsorted(both[:, 0], np.arange(len(old) + 1))
    for row, own in enumerate(target):
        beside = both[ends[row] : ends[row + 1], 1]
        beside = beside[target[beside] >= 0]
        if own < 0 or len(beside) < LEAST_NEIGHBOURS:
            continue
        first, second = old[beside] - old[row], new[target[beside]] - new[own]
        gradient, _, rank, _ = np.linalg.lstsq(first, second, rcond=None)
        if rank == 2:
            strain = 0.5 * (gradient + gradient.T) - np.eye(2)
            left = ((second - first @ gradient) ** 2).sum() / len(beside)
            found[own] = strain[0, 0], strain[1, 1], strain[0, 1], left
    return found
