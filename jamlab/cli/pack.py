"""`jamlab pack`: a packing at a pressure."""

from pathlib import Path
from typing import Annotated, Any

import typer

from jamlab.cli.console import bars, report
from jamlab.cli.options import Ensemble, Json, N, Out, Seed, Tolerance
from jamlab.packing.atomic_file import check_target


def pack(
    pressure: Annotated[float, typer.Option(help="Target pressure, k.")],
    n: N = 256,
    seed: Seed = 1,
    ensemble: Ensemble = "fixed-box",
    ranks: Annotated[int, typer.Option(help="MPI ranks; pays from about 10 000 disks.")] = 1,
    tolerance: Tolerance = None,
    out: Out = Path("packing.h5"),
    as_json: Json = False,
) -> None:
    """An SP packing at a target pressure, law and units of Baumgarten & Tighe."""
    from jamlab.protocols.target_pressure import pack as run

    check_target(out)
    with bars({"sp": "to pressure"}, 1.0) as tell:
        how: dict[str, Any] = {"ensemble": ensemble, "ranks": ranks, "tolerance": tolerance}
        packing = run(n, pressure, seed, progress=lambda *a: tell("sp", *a), **how)
    report([packing], out, as_json)
