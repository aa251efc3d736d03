"""Follow droplets through pictures.

Droplets of two pictures are matched so that squared displacements sum up to least; none goes further than half the
spacing. With a memory, one that is missed keeps its number and is sought where it was seen last.

Source: H. W. Kuhn, Nav. Res. Logist. Q. 2, 83 (1955), for the matching.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import min_weight_full_bipartite_matching
from scipy.spatial import KDTree

from jamlab.arrays import Array, Indices
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.micrographs.micrograph import micrograph

if TYPE_CHECKING:
    import pandas as pd

FARTHEST = 0.5  # of the spacing, that a droplet may move from one picture to the next


@checked
def track_droplets(source: Sequence[Any], *, memory: int = 0, **how: Any) -> pd.DataFrame:
    """Track droplets through a series of pictures.

    Args:
        source: pictures in the order of time, as for `jamlab.micrograph`.
        memory: number of successive pictures in which a droplet may be missing and keep its number.
        how: further arguments of `jamlab.micrograph`, the same for all pictures.

    Returns:
        Table with a row per droplet and picture: the columns of `Micrograph.table`, frame and particle, as trackpy
        names them.

    Raises:
        InputError: fewer than two pictures, a negative memory, or an error of `jamlab.micrograph`.

    Example:
        >>> p = jamlab.jam(model="dp", n=16, seed=1)
        >>> pictures = [jamlab.synthetic_micrograph(p, 300, seed=k, noise=0.02) for k in range(3)]
        >>> tracks = jamlab.track_droplets(pictures, contrast="bright")
        >>> tracks.groupby("particle").size().tolist()  # pictures in which each one is seen
        [3, 3, 3, 3, 3, 3, 3, 3, 3]
    """
    if memory < 0:
        raise InputError(f"memory is {memory}: must be a number of pictures, 0 or more")
    if len(source) < 2:
        raise InputError(f"{len(source)} pictures: tracking needs two or more")
    tracks: pd.DataFrame = _link([micrograph(picture, **how).table() for picture in source], memory)
    return tracks


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
