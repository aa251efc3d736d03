"""`jamlab analyze` and `explore`: measure the packings of a file or the droplets of a picture; states as one page."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from jamlab.cli.console import (
    err_console,
    out_console,
    print_json,
    print_note,
    print_packings,
    print_table,
    progress_bar,
)
from jamlab.cli.given import is_picture
from jamlab.cli.interruption import expect_output
from jamlab.cli.option_values import Reading
from jamlab.cli.options import Written, command
from jamlab.cli.picture_series import analyze_series, is_series, refuse_for_series
from jamlab.errors import InputError
from jamlab.storage.atomic_file import check_target
from jamlab.storage.table_file import write_table

if TYPE_CHECKING:
    from jamlab.micrographs.measured_droplets import Micrograph


@command("read_all", "micrograph", "track_droplets", "measure")
def analyze(
    file: Path | None,
    *,
    pixel: float | None,
    film: float | None,
    contrast: str,
    labels: Path | None,
    channel: str,
    memory: int | None,
    quantities: list[str] | None,
    workers: int | None,
    overlay: Annotated[Path | None, Written(("png",))],
    reading: Reading,
    out: Annotated[Path | None, Written(("packings",))],
    csv: Annotated[Path | None, Written(("table",))],
    overwrite: bool,
    json: bool,
) -> None:
    """Measure the packings of a file, or pictures of droplets.

    Packings: rho, z, pressure, moduli, shape factor. Pictures: area, shape, contacts and voids of droplets. A file of
    several pages: droplets are tracked through them. --out writes the droplets of one picture as a relaxed periodic
    packing of --model (default: dp).
    """
    source = file or labels
    if source is None:
        raise InputError("no FILE is given: name a file or a picture, or a label image by --labels")
    if file is not None and file.suffix.lower() in (".npy", ".npz"):
        raise InputError(f"{file}: an array of labels or a mask is given as --labels {file}")
    for path in (overlay, csv, out):
        if path is not None:
            check_target(path, replace=overwrite)
            expect_output(path)
    how: dict[str, Any] = {"pixel": pixel, "film": film, "contrast": contrast, "channel": channel}
    if is_picture({"file": file}) and is_series(file, labels):
        refuse_for_series({"--overlay": overlay, "--out": out})
        analyze_series(source.name, file, labels, memory or 0, how, csv, json)
    elif is_picture({"file": file}):
        if memory is not None:
            raise InputError(f"--memory: for a series, and {source.name} is one picture; leave it out")
        found = _measure_picture(file, labels, how, overlay, csv)
        if out is not None:
            from jamlab.packing.write import write

            write(out, [found.packing(**({} if reading.get("model") is None else {"model": reading["model"]}))])
        print_micrograph(source.name, found, json)
    else:
        from jamlab.trajectories.files import read_all

        packings = read_all(source, **reading)
        _say_what_is_missing(source, packings[0])
        print_packings(packings, None, json, csv, quantities=quantities, workers=workers)


def _measure_picture(
    file: Path | None, labels: Path | None, how: dict[str, Any], overlay: Path | None, csv: Path | None
) -> "Micrograph":
    from jamlab.micrographs.micrograph import micrograph

    found: Micrograph = micrograph(file, labels=labels, **how)
    if overlay is not None:
        found.draw(overlay)
    if csv is not None:
        write_table(found.table(), csv)
    return found


def _say_what_is_missing(file: Path, packing: Any) -> None:
    """Warn of what the numbers of a foreign or old file rest on."""
    from jamlab.storage.verified_file import checksum, is_hdf5

    lines = []
    if is_hdf5(file) and checksum(file) is None:
        lines.append(f"{file.name} has no checksum: damage cannot be detected")
    if assumed := packing.provenance.get("assumed"):
        lines.append(f"{file.name} does not state {', '.join(assumed)}: the defaults of the decks are used")
    if packing.rounding:
        lines.append(
            f"{file.name} has positions rounded to {packing.rounding:.1g}: no moduli, and z only if all contacts "
            "are certain"
        )
    for line in lines:
        err_console.print(line, markup=False)


def print_micrograph(name: str, found: "Micrograph", as_json: bool) -> None:
    """Print what a picture shows, as JSON or as lines; each doubtful number is marked, and reasons are given."""
    numbers = found.numbers
    facts: dict[str, Any] = {
        "cut": found.cut,  # by the edge, and not counted
        "rattlers": int(found.rattlers.sum()),
        "unit": found.unit or "of --pixel",
        **{key: getattr(found, key) for key in ("z_all", "film", "pixel", "contrast", "light", "noise", "blur")},
        "void_sides": {str(sides): share for sides, share in found.voids.probability.items()},
        "label_notes": list(found.label_notes),
        "quality": found.quality,
        "reasons": list(found.reasons),
    }
    if as_json:
        means = {key: number for key, number in numbers.items() if number.count}
        facts |= {key: [facts[key]] for key in ("cut", "rattlers")} | {key: [n.value] for key, n in numbers.items()}
        facts["standard_error"] = {key: mean.error for key, mean in means.items()}
        facts["interval_95"] = {key: n.interval for key, n in numbers.items()}
        facts["numbers"] = {key: {"value": n.value, "quality": n.quality} for key, n in numbers.items()}
        print_json(facts)
        return
    rows = [[key, _text(n.value), _two_digits(n.uncertainty), "?" if n.reasons else ""] for key, n in numbers.items()]
    print_table(f"droplets of {name}", ["", "value", "± (95 %)", ""], rows)
    for key, value in facts.items():
        if text := _text(value):
            print_note(f"{key.replace('_', ' ')}: {text}")


def _two_digits(error: float) -> str:
    return _text(float(f"{error:.2g}"))


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}" if value == value else ""
    if isinstance(value, dict):
        return ", ".join(f"{key}: {_text(each)}" for key, each in value.items())
    return "; ".join(value) if isinstance(value, list) else "" if value is None else str(value)


@command("read_all", "write_page")
def explore(
    file: Path,
    *,
    every: int,
    reading: Reading,
    out: Annotated[Path, Written(("page",))],
    overwrite: bool,
    json: bool,
) -> None:
    """Write an interactive HTML page of a sweep.

    One file shows force network, voids, z, G and pressure of every state.
    """
    from jamlab.figures.explorer.write_page import write_page
    from jamlab.packing.hdf5 import read_observables
    from jamlab.storage.verified_file import is_hdf5
    from jamlab.trajectories.files import read_all

    check_target(out, replace=overwrite)
    expect_output(out)
    packings = read_all(file, **reading)
    known = read_observables(file) if is_hdf5(file) else {}
    with progress_bar("states") as progress:
        write_page(out, packings, every=every, observables=known, progress=progress)
    states, size = len(packings[::every]), out.stat().st_size
    if json:
        print_json({"out": str(out), "states": states, "bytes": size})
    else:
        count = "1 state" if states == 1 else f"{states} states"
        out_console.print(f"wrote {out}: {count}, {size / 1e6:.2g} MB; open it in a browser", soft_wrap=True)
