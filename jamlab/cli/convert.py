"""`jamlab convert` and `relax`: packings from one format to another, and to the energy minimum next to them."""

from pathlib import Path
from typing import Annotated

import typer

from jamlab.cli import options
from jamlab.cli.console import print_line, print_packings, progress_bar
from jamlab.cli.interruption import expect_output
from jamlab.storage.atomic_file import check_target

AnyFile = Annotated[Path, typer.Argument(help="File of jamlab, LAMMPS (.data, .dump), GSD, extended xyz or CSV.")]
Units = Annotated[str | None, typer.Option(metavar="{eps,k}", help="Units of a file that does not state them.")]


def convert(
    file: AnyFile,
    target: Annotated[Path, typer.Argument(help="File to write: .h5, .data, .dump or .xyz.")],
    frame: Annotated[int | None, typer.Option(help="One frame; -1: the last (default: all).")] = None,
    units: Units = None,
    force: options.Force = False,
) -> None:
    """Convert packings to the format of the ending of TARGET."""
    from jamlab.packing.write import write
    from jamlab.trajectories.files import read, read_all

    check_target(target, file, replace=force)
    expect_output(target)
    packings = read_all(file, units=units) if frame is None else [read(file, frame, units=units)]
    write(target, packings)
    print_line(f"wrote {target}: {len(packings)} packing{'s' * (len(packings) > 1)} of {packings[0].n} particles")


def relax(
    file: AnyFile,
    frame: options.Frame = -1,
    units: Units = None,
    tolerance: options.Tolerance = None,
    out: options.Out = Path("relaxed.h5"),
    force: options.Force = False,
    as_json: options.Json = False,
) -> None:
    """Relax a packing to the energy minimum next to it."""
    from jamlab.protocols.relax import relax as run
    from jamlab.trajectories.files import read

    check_target(out, file, replace=force)
    expect_output(out)
    start = read(file, frame, units=units)
    with progress_bar("relax"):
        packing = run(start, tolerance)
    print_packings([packing], out, as_json)
