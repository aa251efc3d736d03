"""`jamlab analyze`: measure the packings of a file or the droplets of a picture."""

from pathlib import Path
from typing import Annotated

import typer

from jamlab.cli.console import print_json, print_packings, print_table
from jamlab.cli.options import Json

PICTURES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp")


def analyze(
    file: Annotated[Path, typer.Argument(help="HDF5 file written by jamlab, or a picture of droplets.")],
    pixel: Annotated[float, typer.Option(help="Picture: size of a pixel, in any unit of length.")] = 1.0,
    film: Annotated[float, typer.Option(help="Picture: widest gap between droplets in contact, in pixels.")] = 2.0,
    dark: Annotated[bool, typer.Option("--dark", help="Picture: droplets are darker than the background.")] = False,
    as_json: Json = False,
) -> None:
    """Measure every packing of a file: rho, z, pressure, moduli, shape factor; or the droplets of a micrograph."""
    from jamlab.packing.hdf5 import read_all

    if file.suffix.lower() not in PICTURES:
        print_packings(read_all(file), None, as_json)
        return
    from jamlab.geometry.micrograph import micrograph

    row = micrograph(file, pixel, film, not dark).measure()
    if as_json:
        print_json({name: [value] for name, value in row.items()})
    else:
        print_table(f"droplets of {file.name}", list(row), [[f"{value:.6g}" for value in row.values()]])
