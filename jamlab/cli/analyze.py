"""`jamlab analyze`: measure the packings of a file or the droplets of a picture."""

from pathlib import Path
from typing import Annotated, Any

import typer

from jamlab.cli.console import err_console, print_json, print_table
from jamlab.cli.options import Json
from jamlab.cli.packing_table import print_packings

PICTURES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp")


def analyze(
    file: Annotated[
        Path,
        typer.Argument(help="File of jamlab (HDF5), LAMMPS data file or dump, GSD file, or a picture of droplets."),
    ],
    pixel: Annotated[float, typer.Option(help="Picture: size of a pixel, in any unit of length.")] = 1.0,
    film: Annotated[float, typer.Option(help="Picture: widest gap between droplets in contact, in pixels.")] = 2.0,
    dark: Annotated[bool, typer.Option("--dark", help="Picture: droplets are darker than the background.")] = False,
    as_json: Json = False,
) -> None:
    """Measure every packing of a file: rho, z, pressure, moduli, shape factor; or the droplets of a micrograph."""
    from jamlab.trajectories.files import read_all

    if file.suffix.lower() not in PICTURES:
        packings = read_all(file)
        _say_what_is_missing(file, packings[0])
        print_packings(packings, None, as_json)
        return
    from jamlab.geometry.micrograph import micrograph

    row = micrograph(file, pixel, film, not dark).measure()
    if as_json:
        print_json({name: [value] for name, value in row.items()})
    else:
        print_table(f"droplets of {file.name}", list(row), [[f"{value:.6g}" for value in row.values()]])


def _say_what_is_missing(file: Path, packing: Any) -> None:
    """Warn of what the numbers of a foreign or old file rest on."""
    import h5py

    from jamlab.packing.checksum import checksum

    if h5py.is_hdf5(file) and checksum(file) is None:
        err_console.print(f"{file.name} has no checksum: damage to it would go unnoticed", markup=False)
    assumed = packing.provenance.get("assumed")
    if assumed:
        err_console.print(
            f"{file.name} does not say {', '.join(assumed)}: defaults of the decks are taken", markup=False
        )
    if packing.rounding:
        err_console.print(
            f"{file.name} holds positions to {packing.rounding:.1g} only: no moduli, and z only where it is certain",
            markup=False,
        )
