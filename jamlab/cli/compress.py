"""`jamlab compress`: a sweep above onset."""

from pathlib import Path
from typing import Annotated, Any

import typer

from jamlab.cli.kept_states import KeptStates
from jamlab.cli.options import File, Force, Frame, Json, Out, Ranks, Tolerance
from jamlab.cli.packing_table import print_packings
from jamlab.cli.progress import progress_bar
from jamlab.storage.atomic_file import check_target


def compress(
    file: File,
    to: Annotated[float, typer.Option(help="Last packing fraction.")],
    step: Annotated[float, typer.Option(help="Distance between two states.")] = 0.01,
    by: Annotated[str, typer.Option(help="rho (true) or phi (nominal packing fraction).")] = "rho",
    nearest: Annotated[float | None, typer.Option(help="First step; log-spaced from there on.")] = None,
    error: Annotated[float | None, typer.Option(help="Follow the basin to this relative error of pressure.")] = None,
    frame: Frame = -1,
    ranks: Ranks = 1,
    tolerance: Tolerance = None,
    out: Out = Path("sweep.h5"),
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Compress or decompress a packing in steps; the first frame written is the start."""
    from jamlab.packing.hdf5 import read
    from jamlab.protocols.compression import compress as run

    check_target(out, file, replace=force)
    start, kept = read(file, frame), KeptStates(out)
    with kept, progress_bar("compress") as progress:
        how: dict[str, Any] = {"by": by, "nearest": nearest, "error": error, "ranks": ranks}
        how["tolerance"] = tolerance
        kept.add(start)
        for state in run(start, to, step, progress=progress, **how):
            kept.add(state)
    print_packings(kept.states, out, as_json)
