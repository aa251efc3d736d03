"""`jamlab jam`, `pack`, `compress`, `decompress`, `droplets`, `relax`: make packings; `convert`: files; `demo`: both on
a page."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from jamlab.arguments.choices import By, ModelName, Registered, Search, Start
from jamlab.cli.console import print_line, print_note, print_packings, progress_bar
from jamlab.cli.interruption import NOTHING, describe_kept, expect_output
from jamlab.cli.option_values import Box, Law, Making, Reading
from jamlab.cli.options import Written, command
from jamlab.cli.sweep_file import SweepFile
from jamlab.errors import InputError
from jamlab.storage.atomic_file import check_target

if TYPE_CHECKING:
    from markupsafe import Markup

    from jamlab.packing.model import Model
    from jamlab.packing.packing import Packing
    from jamlab.processes.progress import Progress

Out = Annotated[Path, Written(("packings",))]


@command("jam")
def jam(
    *,
    model: ModelName,
    n: int,
    seed: int,
    making: Making,
    search: Search,
    step: float | None,
    start: Start | None,
    out: Out,
    overwrite: bool,
    json: bool,
) -> None:
    """Make a packing at jamming onset.

    The protocol follows Boromand et al., section 2.3. No file is written if interrupted:
    intermediate states are not at onset.
    """
    import jamlab

    check_target(out, replace=overwrite)
    expect_output(out)
    how: dict[str, Any] = {"search": search, "step": step, "start": start}
    with progress_bar("to onset") as progress:
        packing = jamlab.jam(n, Registered(model), seed, progress=progress, **how, **making)
    print_packings([packing], out, json)


@command("pack")
def pack(
    *,
    pressure: float | None,
    phi: float | None,
    n: int,
    seed: int,
    making: Making,
    out: Out,
    overwrite: bool,
    json: bool,
) -> None:
    """Make a packing of disks at a pressure or packing fraction.

    Force law and units follow Baumgarten & Tighe. No file is written if interrupted: intermediate states have other
    pressures.
    """
    import jamlab

    if (pressure is None) == (phi is None):
        raise InputError("give --pressure or --phi, one of them")
    check_target(out, replace=overwrite)
    expect_output(out)
    with progress_bar("to pressure") as progress:
        packing = jamlab.pack(n, pressure, seed, phi=phi, progress=progress, **making)
    print_packings([packing], out, json)


@command("compress", "read")
def compress(
    file: Path,
    *,
    to: float,
    step: float,
    by: By,
    first_step: float | None,
    per_decade: int | None,
    pressure_tolerance: float | None,
    frame: int,
    ranks: int,
    force_tolerance: float | None,
    reading: Reading,
    out: Out,
    overwrite: bool,
    json: bool,
) -> None:
    """Compress or decompress a packing in steps.

    The first frame written is the start. The same command resumes an interrupted sweep.
    """
    from jamlab.protocols.compression import go_on
    from jamlab.trajectories.files import read

    how: dict[str, Any] = {"by": by, "first_step": first_step, "per_decade": per_decade}
    how |= {"pressure_tolerance": pressure_tolerance, "force_tolerance": force_tolerance}
    task = {"--to": to, "--step": step, **{f"--{name.replace('_', '-')}": value for name, value in how.items()}}
    sweep = SweepFile(out, task, replace=overwrite)
    sweep.begin(read(file, frame, **reading))
    with progress_bar("compress") as progress:
        sweep.make(lambda last, start, done: go_on(last, start, done, to, step, ranks=ranks, progress=progress, **how))
    print_packings(sweep.states, out, json, save=sweep.write)


@command("decompress", "read")
def decompress(
    file: Path,
    *,
    pressure: float,
    frame: int,
    ranks: int,
    force_tolerance: float | None,
    reading: Reading,
    out: Out,
    overwrite: bool,
    json: bool,
) -> None:
    """Decompress a packing to a lower pressure.

    No file is written if interrupted: intermediate states have other pressures.
    """
    from jamlab.protocols.decompression import decompress as run
    from jamlab.trajectories.files import read

    check_target(out, replace=overwrite)
    expect_output(out)
    start = read(file, frame, **reading)
    with progress_bar("to pressure") as progress:
        packing = run(start, pressure, ranks=ranks, force_tolerance=force_tolerance, progress=progress)
    print_packings([packing], out, json)


@command("read_all", "write")
def convert(file: Path, target: Path, *, frame: int | None, reading: Reading, overwrite: bool) -> None:
    """Convert packings to the format of the ending of TARGET.

    It is .h5, .data, .dump or .xyz.
    """
    from jamlab.trajectories.convert import convert as run

    check_target(target, replace=overwrite)
    expect_output(target)
    packings, lost = run(file, target, frame, **reading)
    print_line(f"wrote {target}: {len(packings)} packing{'s' * (len(packings) > 1)} of {packings[0].n} particles")
    if lost:
        print_line(f"{target} does not hold: {', '.join(lost)}")


@command("droplets_from_outlines")
def droplets(
    file: Path,
    *,
    box: Box,
    rims: bool,
    vertices: int | None,
    wrapped: bool,
    law: Law,
    out: Out,
    overwrite: bool,
    json: bool,
) -> None:
    """Make droplets of given outlines, not relaxed.

    FILE is GeoJSON, or a table with columns droplet, x, y and a row for each vertex. Columns free_area or rest_area of
    the table set the sizes of droplets; by default a droplet that nothing touches has the area of its outline. Go on
    with `jamlab relax`.
    """
    import jamlab
    from jamlab.trajectories.outline_files import read_outlines

    check_target(out, replace=overwrite)
    expect_output(out)
    how: dict[str, Any] = {"rims": rims, "vertices": vertices, "wrapped": wrapped, "law": law}
    packing = jamlab.droplets_from_outlines(**read_outlines(file), box=box, **how)
    print_packings([packing], out, json)


@command("relax", "read")
def relax(
    file: Path,
    *,
    frame: int,
    force_tolerance: float | None,
    reading: Reading,
    out: Out,
    overwrite: bool,
    json: bool,
) -> None:
    """Relax a packing to the energy minimum next to it."""
    from jamlab.protocols.relax import relax as run
    from jamlab.trajectories.files import read

    check_target(out, replace=overwrite)
    expect_output(out)
    start = read(file, frame, **reading)
    with progress_bar("relax"):
        packing = run(start, force_tolerance)
    print_packings([packing], out, json)


_DEMO_STEP, _ON_PAGE = 2.5e-3, 50  # of rho; states of each model on the page, at most
_DEMO_ROWS = 10  # every tenth state is printed: a table of each model fits on a screen


@command()
def demo(*, n: int, seed: int, to: float, folder: Path, overwrite: bool) -> None:
    """Compress disks and droplets through jamming: tables, a page."""
    from jamlab.checks import check_number
    from jamlab.figures.explorer.write_page import write_sections
    from jamlab.models.disks import DISKS
    from jamlab.models.droplets import DROPLETS
    from jamlab.protocols.particle_numbers import check_bidisperse
    from jamlab.storage.atomic_file import make_folder
    from jamlab.storage.verified_file import versions

    check_bidisperse(n, seed, 1.0)
    check_number("to", to, 1.0)
    make_folder(folder)
    check_target(folder / "index.html", replace=overwrite)
    task = {"--n": n, "--seed": seed, "--to": to, "step": _DEMO_STEP}
    models = (DISKS, DROPLETS)
    sweeps = [
        SweepFile(folder / f"{model.name}.h5", task | {"model": model.name}, replace=overwrite) for model in models
    ]
    describe_kept(lambda: _describe_demo(folder))
    sections = [
        (f"Sweep of {model.particles}", _sweep_for_demo(sweep, model, n, seed, to))
        for sweep, model in zip(sweeps, models, strict=True)
    ]
    title = "Jamming of soft disks and deformable droplets"
    lead = (
        "From a random start at φ = 0.20 to jamming onset, "
        f"and from there in steps of {_DEMO_STEP} in ρ to dense packings. "
        "The box is relaxed to zero shear stress, so no stable state has a negative shear modulus. "
        f"The page shows up to {_ON_PAGE} states of each model, from onset to the densest; "
        "the HDF5 files hold all of them."
    )
    write_sections(folder / "index.html", title, lead, sections, {"seed": str(seed), **versions()})
    print_note(f"Open {folder / 'index.html'}")


def _sweep_for_demo(sweep: SweepFile, model: "Model[Any]", n: int, seed: int, to: float) -> "Markup":
    """Make the states of a model that are not in its file yet, print them, and give their part of the page."""
    import numpy as np

    from jamlab.figures.explorer.write_page import explorer_fragment
    from jamlab.packing.hdf5 import read_observables
    from jamlab.protocols.onset import jam as begin

    if not sweep.states:
        with progress_bar(f"{model.particles} to onset") as progress:
            sweep.begin(begin(n, Registered(model.name), seed, ensemble="shear-stabilized", progress=progress))
    packings = sweep.states
    if to <= packings[0].phi:
        raise InputError(
            f"--to {to}: {model.particles} with --n {n}, --seed {seed} jam at {packings[0].phi:.4f}; use a larger value"
        )
    with progress_bar(f"{model.particles} compressed") as progress:
        sweep.make(partial(_compress_for_demo, to, progress))
    print_packings(packings, sweep.path, False, save=sweep.write, step=_DEMO_ROWS)
    kept = np.linspace(0, len(packings) - 1, min(len(packings), _ON_PAGE)).round().astype(int)
    observables = {column: values[kept] for column, values in read_observables(sweep.path).items()}
    return explorer_fragment([packings[k] for k in kept], observables=observables)


def _compress_for_demo(
    to: float, progress: "Progress", last: "Packing", start: "Packing", done: int
) -> "Iterator[Packing]":
    from jamlab.protocols.compression import go_on

    return go_on(last, start, done, to, _DEMO_STEP, progress=progress)


def _describe_demo(folder: Path) -> str:
    found = [name for name in ("sp.h5", "dp.h5") if (folder / name).exists()]
    return f"kept {' and '.join(found)} in {folder}; the same command resumes it" if found else NOTHING
