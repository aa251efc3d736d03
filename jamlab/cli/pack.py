"""`jamlab pack`: a packing at a pressure."""

from pathlib import Path
from typing import Annotated, Any

import typer

from jamlab.cli.interruption import expect_output
from jamlab.cli.options import (
    Ensemble,
    Force,
    Json,
    Large,
    Law,
    N,
    Out,
    Ranks,
    Ratio,
    Seed,
    Sizes,
    Tolerance,
    law_values,
)
from jamlab.cli.packing_table import print_packings
from jamlab.cli.progress import progress_bar
from jamlab.storage.atomic_file import check_target


def pack(
    pressure: Annotated[float, typer.Option(help="Target pressure, in units of k.")],
    n: N = 256,
    seed: Seed = 1,
    ensemble: Ensemble = "fixed-box",
    ranks: Ranks = 1,
    law: Law = None,
    ratio: Ratio = None,
    large: Large = 0.5,
    sizes: Sizes = None,
    tolerance: Tolerance = None,
    out: Out = Path("packing.h5"),
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Make a packing of disks at a target pressure, with the force law and units of Baumgarten & Tighe."""
    from jamlab.protocols.target_pressure import pack as run

    check_target(out, replace=force)
    expect_output(out)
    with progress_bar("to pressure") as progress:
        how: dict[str, Any] = {
            "ensemble": ensemble,
            "ranks": ranks,
            "tolerance": tolerance,
            "ratio": ratio,
            "large": large,
            "sizes": sizes,
            **law_values(law),
        }
        packing = run(n, pressure, seed, progress=progress, **how)
    print_packings([packing], out, as_json)
