"""Follow droplets through pictures.

Droplets of two pictures are matched so that squared displacements sum up to least; none goes further than half the
spacing. With a memory, one that is missed keeps its number and is sought where it was seen last. Strain and D2min of
a droplet are moments of the vectors to its neighbours, from the frame before to this one.

Source: H. W. Kuhn, Nav. Res. Logist. Q. 2, 83 (1955), for the matching; M. L. Falk & J. S. Langer, Phys. Rev. E 57,
7192 (1998), for D2min.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import min_weight_full_bipartite_matching
from scipy.spatial import KDTree

from jamlab.arguments.choices import Channel, Contrast
from jamlab.arrays import Array, Indices
from jamlab.checks import checked
from jamlab.errors import InputError, warn
from jamlab.micrographs.measured_droplets import Micrograph
from jamlab.micrographs.micrograph import micrograph
from jamlab.micrographs.picture_files import NoDropletsError
from jamlab.micrographs.series import SeriesFrame, read_series
from jamlab.motion.best_map import best_maps
from jamlab.motion.t1_events import bonds, common_places, find_swaps

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Tracking:
    """Droplets that are followed from picture to picture."""

    farthest: float = 0.5  # of the spacing, that a droplet may move from one picture to the next
    named: int = 5  # frames without droplets that a warning names


TRACKING = Tracking()


@checked
def track_droplets(
    source: str | Path | Sequence[Any] | None = None,
    *,
    memory: int = 0,
    labels: str | Path | Sequence[Any] | None = None,
    pixel: float | None = None,
    film: float | None = None,
    contrast: Contrast = "auto",
    channel: Channel = "grey",
) -> pd.DataFrame:
    """Track droplets through a series of pictures or labels, with local strains and T1 events.

    A frame without droplets, such as a dark one, is skipped with a warning.

    Args:
        source: frames in the order of time: pictures as for `jamlab.micrograph`, arrays of labels or masks (True in
            droplets), files, or `Micrograph` objects; an array (t, h, w); or one TIFF or NPY file of several pages.
        memory: number of successive pictures in which a droplet may be missing without losing its number.
        labels: labels of the frames, in the same forms; if they are given, `source` may be omitted.
        pixel, film, contrast, channel: as in `jamlab.micrograph`, the same for all pictures.

    Returns:
        Table with a row per droplet and picture: the columns of `Micrograph.table`, and frame and particle with the
        names of trackpy. Since the frame before: strain_xx, strain_xy, strain_yx, strain_yy (strain_xy is d u_x / d y;
        y points down) and d2min (squared lengths), as in `jamlab.local_strain`, nan without three neighbours in both
        frames; t1, the number of `jamlab.t1_events` of the droplet. `.attrs` has the unit of length.

    Raises:
        InputError: fewer than two pictures, no droplets, pictures of different size or unit, a negative memory, or an
            error of `jamlab.micrograph`, with the number of the frame.

    Example:
        >>> p = jamlab.jam(16, "dp")
        >>> pictures = [jamlab.synthetic_micrograph(p, 300, seed=k, noise=0.02) for k in range(3)]
        >>> tracks = jamlab.track_droplets(pictures, contrast="bright")
        >>> tracks.groupby("particle").size().tolist()  # pictures in which each one is seen
        [3, 3, 3, 3, 3, 3, 3, 3, 3]
        >>> y, x = np.indices((90, 120))
        >>> masks = [np.hypot(x % 30 - 15, (y - k) % 30 - 15) < 13 for k in range(3)]
        >>> jamlab.track_droplets(masks).groupby("particle")["y"].max().head(2).tolist()
        [17.0, 17.0]
    """
    how = {"pixel": pixel, "film": film, "contrast": contrast, "channel": channel}
    usual = {"contrast": "auto", "channel": "grey"}
    given = {name: value for name, value in how.items() if value != usual.get(name)}
    return link_frames(measure_frames(source, labels, given), memory)


def link_frames(frames: Sequence[Micrograph | None], memory: int) -> pd.DataFrame:
    """Tracks through frames that are measured, as `track_droplets` returns them."""
    if memory < 0:
        raise InputError(f"memory is {memory}: must be a number of pictures, 0 or more")
    tracks: pd.DataFrame = _link([found.table() if found is not None else None for found in frames], memory)
    return with_strains(tracks)


def with_strains(tracks: pd.DataFrame) -> pd.DataFrame:
    """Tracks with strain, D2min and the number of T1 events of each droplet since the frame before."""
    found = np.full((len(tracks), 5), np.nan)
    swaps = np.zeros(len(tracks), dtype=np.int64)
    rows = [np.flatnonzero(tracks["frame"] == frame) for frame in np.unique(tracks["frame"])]
    for before, now in pairwise(rows):
        first, second = tracks.iloc[before], tracks.iloc[now]
        old, new = common_places(first, second)
        row = now[np.intersect1d(first["particle"], second["particle"], return_indices=True)[2]]
        edges = bonds(old)
        ends = np.concatenate([edges, edges[:, ::-1]]).T
        moved = new - old
        maps = best_maps(len(old), ends[0], old[ends[1]] - old[ends[0]], moved[ends[1]] - moved[ends[0]])
        found[row] = np.column_stack([maps.change.reshape(-1, 4), maps.left])
        pairs = (set(map(tuple, each.tolist())) for each in (edges, bonds(new)))
        np.add.at(swaps, row[np.array(find_swaps(*pairs), dtype=np.int64).ravel()], 1)
    names = ("strain_xx", "strain_xy", "strain_yx", "strain_yy", "d2min")
    return tracks.assign(**dict(zip(names, found.T, strict=True)), t1=swaps)


def measure_frames(source: Any, labels: Any, how: dict[str, Any]) -> list[Micrograph | None]:
    """What each frame of a series shows, None for one without droplets; arguments as of `track_droplets`."""
    found: list[Micrograph | None] = []
    empty: dict[int, str] = {}
    for number, frame in enumerate(read_series(source, labels, how)):
        try:
            found.append(_measured(frame, how))
        except NoDropletsError as error:
            found.append(None)
            empty[number] = str(error)
        except InputError as error:
            raise type(error)(f"frame {number}: {error}") from None
    seen = {number: each for number, each in enumerate(found) if each is not None}
    if not seen:
        raise InputError(f"no frame of {len(found)} has droplets: frame 0: {empty[0]}")
    _check_alike(seen)
    if empty:
        names = ", ".join(map(str, [*empty][: TRACKING.named])) + (
            f" and {len(empty) - TRACKING.named} more" if len(empty) > TRACKING.named else ""
        )
        several = "s" if len(empty) > 1 else ""
        warn(f"frame{several} {names} of {len(found)} without droplets: {next(iter(empty.values()))}")
    return found


def _check_alike(seen: dict[int, Micrograph]) -> None:
    """Refuse frames, by number, that differ in what no series does."""
    (first, one), *rest = seen.items()
    for number, other in rest:
        for what, own, there in (("size", one.picture.shape, other.picture.shape), ("unit", one.unit, other.unit)):
            if own != there:
                raise InputError(f"frame {number} has the {what} {there}, frame {first} {own}: must be the same")
        if one.pixel != other.pixel and abs((one.pixel or 1.0) / (other.pixel or 1.0) - 1) > 1e-6:
            raise InputError(f"frame {number} has pixels of {other.pixel}, frame {first} of {one.pixel}: give pixel=")


def _measured(frame: SeriesFrame, how: dict[str, Any]) -> Micrograph:
    if isinstance(frame.picture, Micrograph):
        return frame.picture
    stated: dict[str, Any] = {} if frame.pixel is None else {"pixel": frame.pixel}
    found: Micrograph = micrograph(frame.picture, labels=frame.labels, **(stated | how))
    return frame.named(found)


def _link(tables: list[Any], memory: int = 0) -> Any:
    """One table of all pictures; the same droplet has the same `particle`, also if it was missed `memory` times. None
    is a picture without droplets."""
    import pandas as pd

    lost = pd.DataFrame()  # droplets seen before, with their last place
    count, linked = 0, []
    for frame, now in enumerate(tables):
        if now is not None and len(now):
            names = np.full(len(now), -1)
            if len(lost):
                last = lost.loc[lost["frame"] == lost["frame"].max(), "cell"]
                reach = TRACKING.farthest * float(np.sqrt(last.median()))
                rows, columns = _match(lost[["x", "y"]].to_numpy(), now[["x", "y"]].to_numpy(), reach)
                names[columns] = lost["particle"].to_numpy()[rows]
            fresh = names < 0
            names[fresh] = count + np.arange(fresh.sum())
            count += int(fresh.sum())
            linked.append(now.assign(frame=frame, particle=names))
            lost = pd.concat([lost, linked[-1]]).drop_duplicates("particle", keep="last")
        if len(lost):
            lost = lost[lost["frame"] >= frame - memory]
    table = pd.concat(linked, ignore_index=True)
    table.attrs = {key: value for key, value in linked[0].attrs.items() if key == "unit"}
    return table


def _match(old: Array, new: Array, reach: float) -> tuple[Indices, Indices]:
    """Rows of points (n, 2) and of points (m, 2) that belong together: pairs nearer than `reach`, whose squared
    distances and `reach` squared for each of the n left over sum up to least."""
    near = KDTree(old).sparse_distance_matrix(KDTree(new), reach, output_type="ndarray")
    alone, n, m = np.arange(len(old)), len(old), len(new)
    cost = np.concatenate([near["v"] ** 2, np.full(n, reach**2)]) + reach**2  # none is 0, which would be no pair
    ends = np.concatenate([near["i"], alone]), np.concatenate([near["j"], m + alone])
    rows, columns = min_weight_full_bipartite_matching(coo_array((cost, ends), (n, n + m)).tocsr())
    return rows[columns < m], columns[columns < m]
