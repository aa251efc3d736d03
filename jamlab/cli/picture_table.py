"""The table of a micrograph that `jamlab analyze` prints: numbers, verdict and reasons."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from jamlab.cli.console import print_json, print_note, print_table
from jamlab.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

    from jamlab.micrographs.measured_droplets import Micrograph
    from jamlab.micrographs.tracks import Tracks

DOUBT = " ?"  # beside every number of a doubtful picture
SIDES = {
    "bright": "bright on dark",
    "dark": "dark on bright",
    "ring": "with dark walls",
    "labels": "as labelled",
}
MOST_SIDES = 6  # voids with more are one entry of the table


def print_micrograph(name: str, found: "Micrograph", as_json: bool) -> None:
    """Print what a picture shows; a doubtful verdict marks every number and gives its reasons."""
    from jamlab.micrographs.quality import LIMITS

    if as_json:
        print_json(_json(found))
        return
    mark = DOUBT if found.reasons else ""
    length = "pixels" if found.pixel is None else "units of --pixel"
    means = found.means
    row = {
        "droplets": f"{found.count}",
        "cut": f"{found.cut}",
        "rho": means["rho"].text(".4f"),
        "z": means["z"].text(".2f"),
        "A": means["shape_rim"].text(".4f"),
        "rattlers": f"{found.rattlers.sum()}",
        "voids": f"{len(found.voids.sides)}",
        "radius": means["radius"].text(".4g"),
    }
    print_table(f"droplets of {name}", list(row), [[value + mark for value in row.values()]])
    print_note(
        f"± standard error over the droplets; light, blur and films of a good picture shift rho by up to "
        f"{LIMITS['rho']:g}, z by {LIMITS['z']:g}, A by {LIMITS['shape']:g}"
    )
    share = found.voids.probability
    sides = [f"P_{k} = {share[k]:.2f}{mark}" for k in share if k <= MOST_SIDES]
    more = sum(part for k, part in share.items() if k > MOST_SIDES)
    print_note(", ".join([*sides, *([f"P_{MOST_SIDES + 1}+ = {more:.2f}{mark}"] if more else [])]) or "no voids")
    print_note(f"sizes: {found.sizes}{mark}; lengths in {length}; droplets that the edge cuts are not counted")
    print_note(
        f"droplets {SIDES[found.contrast]}; light {found.light:.2g} to 1, noise {found.noise:.0%} of the contrast, "
        f"blur {found.blur:.1f} pixels"
    )
    print_note(_balance(found))
    print_note(f"quality: {found.quality}")
    for reason in found.reasons:
        print_note(f"{DOUBT.strip()} {reason}")


def _balance(found: "Micrograph") -> str:
    """How far forces by shape balance on a droplet, or why there are none."""
    try:
        residual = found.forces.residual
    except InputError as refused:
        return str(refused)
    known = residual[np.isfinite(residual)]
    if not len(known):
        return "no forces of droplets: no free wall to read a pressure off"
    return f"forces by shape leave {np.median(known):.0%} of what presses on a droplet unbalanced (median)"


def print_tracks(name: str, tracks: "Tracks", as_json: bool) -> None:
    """Print what happened between the pictures, a row for each."""
    strains, rows = ["strain_xx", "strain_yy", "strain_xy", "d2min"], []
    for frame in sorted(tracks.table["frame"].unique()):
        part = tracks.table[tracks.table["frame"] == frame]
        kinds = tracks.events[tracks.events["frame"] == frame]["kind"]
        row: dict[str, float | None] = {"frame": int(frame), "droplets": len(part)}
        row |= {kind: int((kinds == kind).sum()) for kind in ("gained", "lost", "T1")}
        row |= {name: float(part[name].mean()) if part[name].notna().any() else None for name in strains}
        rows.append(row)
    if as_json:
        print_json({"followed": tracks.count, "spacing": tracks.spacing, "frames": rows})
        return
    cells = [["" if value is None else f"{value:.3g}" for value in row.values()] for row in rows]
    print_table(f"droplets of {name}, followed", list(rows[0]), cells)
    print_note(f"{tracks.count} droplets are in every frame; strain and D2min from the frame before, means")


def _json(found: "Micrograph") -> dict[str, object]:
    numbers = {"count": found.count, "cut": found.cut, **found.measure(), "voids": len(found.voids.sides)}
    sizes = found.sizes
    return {
        **{name: [value] for name, value in numbers.items()},
        "standard_error": {name: mean.error for name, mean in found.means.items()},
        "interval_95": {name: mean.interval for name, mean in found.means.items()},
        "void_sides": {str(sides): share for sides, share in found.voids.probability.items()},
        "sizes": {
            "verdict": sizes.verdict,
            "mean_radius": sizes.mean,
            "spread": sizes.spread,
            "ratio": sizes.ratio,
            "large": sizes.large,
        },
        "pixel": found.pixel,
        "unit": "pixels" if found.pixel is None else "pixel",
        "contrast": found.contrast,
        "quality": found.quality,
        "reasons": list(found.reasons),
    }


def write_droplets(table: "pd.DataFrame", path: Path) -> None:
    """Write a table of droplets or tracks as CSV."""
    from jamlab.storage.atomic_file import atomic_file

    with atomic_file(path) as temporary:
        table.to_csv(temporary, index=False)
