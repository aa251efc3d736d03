"""`jamlab explore`: the states of a file as one interactive page."""

from pathlib import Path
from typing import Annotated

import typer

from jamlab.cli.console import out_console, print_json, progress_bar
from jamlab.cli.interruption import expect_output
from jamlab.cli.options import Force, Json
from jamlab.storage.atomic_file import check_target


def explore(
    file: Annotated[Path, typer.Argument(help="File of jamlab (HDF5), LAMMPS data file or dump, or GSD file.")],
    every: Annotated[int, typer.Option(help="Take every k-th state, from the first on.")] = 1,
    out: Annotated[Path, typer.Option(help="HTML file to write.")] = Path("explorer.html"),
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write one self-contained page to look through a sweep: slider, force network, voids, cells, z, G and pressure."""
    import h5py

    from jamlab.figures.explorer.write_page import write_page
    from jamlab.packing.hdf5 import read_observables
    from jamlab.trajectories.files import read_all

    check_target(out, file, replace=force)
    expect_output(out)
    packings = read_all(file)
    known = read_observables(file) if h5py.is_hdf5(file) else {}
    with progress_bar("states") as progress:
        write_page(out, packings, every=every, observables=known, progress=progress)
    states, size = len(packings[::every]), out.stat().st_size
    if as_json:
        print_json({"out": str(out), "states": states, "bytes": size})
    else:
        count = "1 state" if states == 1 else f"{states} states"
        out_console.print(f"wrote {out}: {count}, {size / 1e6:.2g} MB; open it in a browser", soft_wrap=True)
