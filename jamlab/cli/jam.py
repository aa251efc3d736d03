"""`jamlab jam`: a packing at onset."""

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


def jam(
    model: Annotated[str, typer.Option(help="sp (disks) or dp (droplets).")] = "sp",
    n: N = 64,
    seed: Seed = 1,
    contact: Annotated[str | None, typer.Option(help="Contact form (dp): outline, segment or segment/smooth.")] = None,
    gamma: Annotated[float | None, typer.Option(help="Line tension (dp), eps/l; default 0.4.")] = None,
    ka: Annotated[float | None, typer.Option(help="Area stiffness (dp), eps/l^4; default 300.")] = None,
    delta: Annotated[float | None, typer.Option(help="Width of the rims (dp), l; default 0.25.")] = None,
    law: Law = None,
    ratio: Ratio = None,
    large: Large = 0.5,
    sizes: Sizes = None,
    search: Annotated[str, typer.Option(help="bisection, or paper: steps of 1e-4 throughout.")] = "bisection",
    ensemble: Ensemble = "fixed-box",
    ranks: Ranks = 1,
    tolerance: Tolerance = None,
    out: Out = Path("onset.h5"),
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Make a packing at jamming onset, after Boromand et al., section 2.3."""
    from jamlab.protocols.onset import jam as run

    check_target(out, replace=force)
    expect_output(out)
    with progress_bar("to onset") as progress:
        how: dict[str, Any] = {"search": search, "ensemble": ensemble, "tolerance": tolerance, "ratio": ratio}
        given = {"contact": contact, "gamma": gamma, "ka": ka, "delta": delta}
        how |= {"large": large, "sizes": sizes, "ranks": ranks} | {
            name: value for name, value in given.items() if value is not None
        }
        how |= law_values(law)
        packing = run(model, n, seed, progress=progress, **how)
    print_packings([packing], out, as_json)
