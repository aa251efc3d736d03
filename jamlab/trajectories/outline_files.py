"""Files of outlines: tables with a row for each vertex, in order around every droplet, and polygons as GeoJSON."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from jamlab.errors import InputError
from jamlab.storage.verified_file import FilePath
from jamlab.trajectories.columns import text_of

DROPLETS = (
    "droplet",
    "cell",
    "polygon",
    "label",
    "roi",
    "mol",
    "molecule",
    "particle",
    "id",
)  # columns, the surest first


def read_outlines(path: FilePath) -> dict[str, Any]:
    """Read outlines, and areas if a table has them, as arguments of `jamlab.droplets_from_outlines`.

    A table (.csv, .tsv or other text) names its columns in the first line: x, y and one that tells droplets apart. Rows
    of one droplet stand in the order of its vertices.
    """
    if Path(path).suffix.lower() in (".geojson", ".json"):
        return {"outlines": _geojson(path)}
    import pandas as pd

    with text_of(path) as lines:
        text = [line for line in lines if line.strip()]
        if not text:
            raise InputError("it is empty: give a table of vertices")
        mark = next((mark for mark in (";", "\t", ",") if mark in text[0]), None)
        rows = [line.strip("\r\n").split(mark) for line in text]
        if (wrong := next((k for k, row in enumerate(rows) if len(row) != len(rows[0])), None)) is not None:
            raise InputError(
                f"row {wrong} has {len(rows[wrong])} columns, {len(rows[0])} expected: {text[wrong]!r:.60}"
            )
        table = pd.DataFrame(rows[1:], columns=[name.strip().strip('"').lower() for name in rows[0]])
        names = [name for name in DROPLETS if name in table]
        if not names or not {"x", "y"} <= {*table}:
            raise InputError(
                f"its columns are {', '.join(map(str, table))!r:.80}: give x, y and one of {', '.join(DROPLETS)}, and "
                "a row for each vertex"
            )
        groups = table.groupby(names[0], sort=False)
        found: dict[str, Any] = {"outlines": [_numbers(droplet, part[["x", "y"]]) for droplet, part in groups]}
        # columns with one number a droplet; arguments of `jamlab.droplets_from_outlines`
        for name in (name for name in ("free_area", "rest_area") if name in table):
            found[f"{name}s"] = np.array([_common(droplet, part, name) for droplet, part in groups])
        return found


def _numbers(droplet: Any, part: Any) -> Any:
    try:
        return part.to_numpy(dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"droplet {droplet}: {error}: give numbers in every row") from None


def _common(droplet: Any, part: Any, name: str) -> float:
    values = np.unique(_numbers(droplet, part[name]))
    if len(values) > 1:
        raise InputError(f"{name} of {droplet} is {values[0]:g} and {values[1]:g}: a droplet has one")
    return float(values[0])


def _geojson(path: FilePath) -> list[Any]:
    import shapely

    with text_of(path) as lines:
        try:
            found = shapely.from_geojson("".join(lines))
        except shapely.errors.GEOSException as error:
            raise InputError(f"it is no GeoJSON of polygons: {' '.join(str(error).split())}") from error
        return list(shapely.get_parts(found))
