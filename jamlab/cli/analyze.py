"""`jamlab analyze`: measure the packings of a file or the droplets of a picture."""

from pathlib import Path
from typing import Annotated, Any

import typer

from jamlab.cli.console import err_console
from jamlab.cli.interruption import expect_output
from jamlab.cli.options import Json
from jamlab.cli.packing_table import print_packings
from jamlab.errors import InputError
from jamlab.storage.atomic_file import check_target

PICTURES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp")


def analyze(
    file: Annotated[
        Path,
        typer.Argument(
            help="File of jamlab, LAMMPS or GSD; a picture of droplets; a folder of them, or a track table (CSV)."
        ),
    ],
    pixel: Annotated[
        float | None,
        typer.Option(help="Picture: size of a pixel, in any unit of length; without it lengths are in pixels."),
    ] = None,
    film: Annotated[
        float | None,
        typer.Option(help="Picture: widest gap between droplets in contact, in pixels; default: measured."),
    ] = None,
    contrast: Annotated[
        str, typer.Option(help="Picture: dark, bright or ring (dark walls, light on both sides); default: seen.")
    ] = "auto",
    labels: Annotated[
        Path | None, typer.Option(help="Picture: label image or outlines (JSON) of another program, to be measured.")
    ] = None,
    channel: Annotated[str, typer.Option(help="Picture in colours: grey, red, green or blue.")] = "grey",
    dark: Annotated[bool | None, typer.Option("--dark/--bright", help="Old name of --contrast.", hidden=True)] = None,
    periodic: Annotated[bool, typer.Option("--periodic", help="Picture: one period of a rendered packing.")] = False,
    overlay: Annotated[Path | None, typer.Option(help="Picture: PNG of outlines, numbers, contacts and voids.")] = None,
    packing: Annotated[
        Path | None, typer.Option(help="Picture: HDF5 file of its droplets as a relaxed periodic packing.")
    ] = None,
    model: Annotated[str, typer.Option(help="Model of that packing: dp (droplets) or sp (disks).")] = "dp",
    csv: Annotated[Path | None, typer.Option(help="Picture: CSV with a row per droplet.")] = None,
    as_json: Json = False,
) -> None:
    """Measure every packing of a file: rho, z, pressure, moduli, shape factor; or the droplets of a micrograph."""
    if file.suffix.lower() in PICTURES:
        if dark is not None:
            contrast = "dark" if dark else "bright"
        how = {"pixel": pixel, "film": film, "periodic": periodic, "contrast": contrast, "channel": channel}
        _analyze_picture(file, labels, overlay, csv, as_json, how, (packing, model))
        return
    if file.is_dir() or file.suffix.lower() == ".csv":
        how = {"pixel": pixel, "film": film, "contrast": contrast, "channel": channel}
        _analyze_tracks(file, overlay, csv, as_json, how if file.is_dir() else {})
        return
    if any(path is not None for path in (overlay, csv, labels, packing)):
        raise InputError(
            f"--overlay, --csv, --labels and --packing are for pictures ({', '.join(PICTURES)}); {file.name} is none"
        )
    from jamlab.trajectories.files import read_all

    packings = read_all(file)
    _say_what_is_missing(file, packings[0])
    print_packings(packings, None, as_json)


def _analyze_picture(
    file: Path,
    labels: Path | None,
    overlay: Path | None,
    csv: Path | None,
    as_json: bool,
    how: dict[str, Any],
    wanted: tuple[Path | None, str],
) -> None:
    from jamlab.cli.picture_table import print_micrograph, write_droplets
    from jamlab.micrographs.micrograph import micrograph

    packing, model = wanted
    for path in (overlay, csv, packing):
        if path is not None:
            check_target(path, file)
            expect_output(path)
    found = micrograph(file, labels=labels, **how)
    if overlay is not None:
        found.draw(overlay)
    if csv is not None:
        write_droplets(found.table(), csv)
    if packing is not None:
        found.packing(model).write(packing)
    print_micrograph(file.name, found, as_json)


def _analyze_tracks(file: Path, overlay: Path | None, csv: Path | None, as_json: bool, how: dict[str, Any]) -> None:
    from jamlab.cli.picture_table import print_tracks, write_droplets
    from jamlab.micrographs.tracks import follow

    for path in (overlay, csv):
        if path is not None:
            check_target(path, file)
            expect_output(path)
    tracks = follow(file, **how)
    if overlay is not None:
        figure: Any = tracks.plot().figure
        figure.savefig(overlay)
    if csv is not None:
        write_droplets(tracks.table, csv)
    print_tracks(file.name, tracks, as_json)


def _say_what_is_missing(file: Path, packing: Any) -> None:
    """Warn of what the numbers of a foreign or old file rest on."""
    import h5py

    from jamlab.storage.verified_file import checksum

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
