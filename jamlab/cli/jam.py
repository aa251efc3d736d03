"""`jamlab jam`, `pack`, `compress`, `droplets`, `relax`: make packings; `convert`: files; `demo`: both on a page."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from jamlab.cli import options
from jamlab.cli.console import print_line, print_note, print_packings, progress_bar
from jamlab.cli.interruption import NOTHING, describe_kept, expect_output
from jamlab.cli.options import N, Overwrite, Seed
from jamlab.cli.sweep_file import SweepFile
from jamlab.errors import InputError
from jamlab.storage.atomic_file import check_target

if TYPE_CHECKING:
    from jamlab.packing.packing import Packing
    from jamlab.processes.progress import Progress


def jam(
    model: Annotated[
        str, typer.Option(help="Disks (sp), deformable droplets (dp), or a model of another package by its name.")
    ] = "sp",
    n: options.N = 64,
    seed: options.Seed = 1,
    law: options.Law = None,
    size_ratio: options.Ratio = None,
    fraction_large: options.Large = 0.5,
    sizes: options.Sizes = None,
    search: Annotated[
        str, typer.Option(metavar="{bisection,incremental}", help="Onset search; incremental: steps of 1e-4.")
    ] = "bisection",
    ensemble: options.EnsembleOption = "fixed-box",
    ranks: options.Ranks = 1,
    force_tolerance: options.Tolerance = None,
    out: options.Out = Path("onset.h5"),
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
) -> None:
    """Make a packing at jamming onset.

    The protocol follows Boromand et al., section 2.3. No file is written if interrupted:
    intermediate states are not at onset.
    """
    import jamlab

    check_target(out, replace=overwrite)
    expect_output(out)
    how: dict[str, Any] = {
        "size_ratio": size_ratio,
        "fraction_large": fraction_large,
        "sizes": sizes,
        "search": search,
        "ensemble": ensemble,
    }
    how |= {"ranks": ranks, "force_tolerance": force_tolerance, "law": options.law_values(law, jamlab.jam)}
    with progress_bar("to onset") as progress:
        packing = jamlab.jam(n, model, seed, progress=progress, **how)
    print_packings([packing], out, as_json)


def pack(
    pressure: Annotated[float | None, typer.Option(help="Target pressure (units of k). Or:")] = None,
    phi: Annotated[float | None, typer.Option(help="Nominal packing fraction of a quench, jammed or not.")] = None,
    n: options.N = 256,
    seed: options.Seed = 1,
    ensemble: options.EnsembleOption = "fixed-box",
    ranks: options.Ranks = 1,
    law: options.Law = None,
    size_ratio: options.Ratio = None,
    fraction_large: options.Large = 0.5,
    sizes: options.Sizes = None,
    force_tolerance: options.Tolerance = None,
    out: options.Out = Path("packing.h5"),
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
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
    how: dict[str, Any] = {
        "size_ratio": size_ratio,
        "fraction_large": fraction_large,
        "sizes": sizes,
        "ensemble": ensemble,
    }
    how |= {"ranks": ranks, "force_tolerance": force_tolerance, "law": options.law_values(law, jamlab.pack)}
    with progress_bar("to pressure") as progress:
        packing = jamlab.pack(n, pressure, seed, phi=phi, progress=progress, **how)
    print_packings([packing], out, as_json)


@options.reads_any_file
def compress(
    file: options.AnyFile,
    to: Annotated[float, typer.Option(help="Last packing fraction.")],
    step: Annotated[float, typer.Option(help="Difference in packing fraction between two states.")] = 0.01,
    by: Annotated[
        str, typer.Option(metavar="{rho,phi}", help="True (rho) or nominal (phi) packing fraction in --to and --step.")
    ] = "rho",
    first_step: Annotated[float | None, typer.Option(help="First step; steps grow up to --step.")] = None,
    pressure_tolerance: Annotated[
        float | None, typer.Option(help="Adapt steps to this relative error of pressure.")
    ] = None,
    frame: options.FrameOption = -1,
    ranks: options.Ranks = 1,
    force_tolerance: options.Tolerance = None,
    out: options.Out = Path("sweep.h5"),
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
    *,
    reading: dict[str, Any],
) -> None:
    """Compress or decompress a packing in steps.

    The first frame written is the start. The same command resumes an interrupted sweep.
    """
    from jamlab.protocols.compression import go_on
    from jamlab.trajectories.files import read

    task = {"--to": to, "--step": step, "--by": by, "--first-step": first_step}
    task |= {"--pressure-tolerance": pressure_tolerance, "--force-tolerance": force_tolerance}
    sweep = SweepFile(out, task, replace=overwrite)
    sweep.begin(read(file, frame, **reading))
    how: dict[str, Any] = {"by": by, "first_step": first_step, "pressure_tolerance": pressure_tolerance}
    how["force_tolerance"] = force_tolerance
    with progress_bar("compress") as progress:
        sweep.make(lambda last, start, done: go_on(last, start, done, to, step, ranks=ranks, progress=progress, **how))
    print_packings(sweep.states, out, as_json, save=sweep.write)


@options.reads_any_file
def convert(
    file: options.AnyFile,
    target: Annotated[Path, typer.Argument(help="File to write: .h5, .data, .dump or .xyz.")],
    frame: Annotated[int | None, typer.Option(help="One frame; -1: the last (default: all).")] = None,
    overwrite: options.Overwrite = False,
    *,
    reading: dict[str, Any],
) -> None:
    """Convert packings to the format of the ending of TARGET."""
    from jamlab.trajectories.convert import convert as run

    check_target(target, replace=overwrite)
    expect_output(target)
    packings, lost = run(file, target, frame, **reading)
    print_line(f"wrote {target}: {len(packings)} packing{'s' * (len(packings) > 1)} of {packings[0].n} particles")
    if lost:
        print_line(f"{target} does not hold: {', '.join(lost)}")


def droplets(
    file: Annotated[
        Path, typer.Argument(help="Outlines: a table with columns droplet, x, y and a row for each vertex, or GeoJSON.")
    ],
    box: Annotated[str, typer.Option(metavar="LX,LY", help="Sides of the box, or both lattice vectors, AX,AY,BX,BY.")],
    rims: Annotated[
        bool, typer.Option("--rims", help="Outlines are those of droplets with their rims, as in pictures.")
    ] = False,
    vertices: Annotated[
        int | None,
        typer.Option(help="Vertices of every droplet, with edges of equal length (default: as in the file)."),
    ] = None,
    wrapped: Annotated[bool, typer.Option("--wrapped", help="The box may cut outlines.")] = False,
    law: options.Law = None,
    out: options.Out = Path("droplets.h5"),
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
) -> None:
    """Make droplets of given outlines, not relaxed.

    Columns free_area or rest_area of the table set the sizes of droplets; by default a droplet that nothing touches has
    the area of its outline. Go on with `jamlab relax`.
    """
    import jamlab
    from jamlab.trajectories.outline_files import read_outlines

    check_target(out, replace=overwrite)
    expect_output(out)
    how: dict[str, Any] = {"rims": rims, "vertices": vertices, "wrapped": wrapped}
    how["law"] = options.law_values(law, jamlab.droplets_from_outlines)
    packing = jamlab.droplets_from_outlines(**read_outlines(file), box=options.lattice(box), **how)
    print_packings([packing], out, as_json)


@options.reads_any_file
def relax(
    file: options.AnyFile,
    frame: options.FrameOption = -1,
    force_tolerance: options.Tolerance = None,
    out: options.Out = Path("relaxed.h5"),
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
    *,
    reading: dict[str, Any],
) -> None:
    """Relax a packing to the energy minimum next to it."""
    from jamlab.protocols.relax import relax as run
    from jamlab.trajectories.files import read

    check_target(out, replace=overwrite)
    expect_output(out)
    start = read(file, frame, **reading)
    with progress_bar("relax"):
        packing = run(start, force_tolerance)
    print_packings([packing], out, as_json)


def demo(
    n: N = 64,
    seed: Seed = 1,
    to: Annotated[float, typer.Option(help="Last true packing fraction.")] = 0.95,
    out: Annotated[Path, typer.Option(help="Folder for HDF5 and HTML files.")] = Path("jamlab-demo"),
    overwrite: Overwrite = False,
) -> None:
    """Compress disks and droplets through jamming: tables, a page."""
    import numpy as np

    from jamlab.checks import check_number
    from jamlab.figures.explorer.write_page import explorer_fragment, write_sections
    from jamlab.models.disks import DISKS
    from jamlab.models.droplets import DROPLETS
    from jamlab.packing.hdf5 import read_observables
    from jamlab.protocols.onset import jam as begin
    from jamlab.protocols.particle_numbers import check_bidisperse
    from jamlab.storage.atomic_file import make_folder
    from jamlab.storage.verified_file import versions

    check_bidisperse(n, seed, 1.0)
    check_number("to", to, 1.0)
    make_folder(out)
    check_target(out / "index.html", replace=overwrite)
    task = {"--n": n, "--seed": seed, "--to": to}
    models = {model.name: model for model in (DISKS, DROPLETS)}
    sweeps = {name: SweepFile(out / f"{name}.h5", task | {"model": name}, replace=overwrite) for name in models}
    describe_kept(lambda: _describe_demo(out))
    sections = []
    for name, model in models.items():
        sweep = sweeps[name]
        if not sweep.states:
            with progress_bar(f"{model.particles} to onset") as progress:
                sweep.begin(begin(n, name, seed, ensemble="shear-stabilized", progress=progress))
        packings = sweep.states
        if to <= packings[0].phi:
            raise InputError(
                f"--to {to}: {model.particles} with --n {n}, --seed {seed} jam at {packings[0].phi:.4f}; use a larger "
                "value"
            )
        with progress_bar(f"{model.particles} compressed") as progress:
            sweep.make(partial(_compress_for_demo, to, progress))
        file = sweep.path
        print_packings(packings, file, False, save=sweep.write)
        # states of each model on the page, at most
        kept = np.linspace(0, len(packings) - 1, min(len(packings), 40)).round().astype(int)
        observables = {column: values[kept] for column, values in read_observables(file).items()}
        shown = explorer_fragment([packings[k] for k in kept], observables=observables)
        sections.append((f"Sweep of {model.particles}", shown))
    title = "Jamming of disks and deformable polygons"
    lead = (
        "From a random start at φ = 0.20 to jamming onset, and from there in steps of 0.001 in ρ to dense packings. "
        "The box is sheared until no shear stress is left, so that no stable state has a negative shear modulus. "
        "The page shows up to 40 states of each model, from onset to the densest; the HDF5 files hold all of them."
    )
    write_sections(out / "index.html", title, lead, sections, {"seed": str(seed), **versions()})
    print_note(f"Open {out / 'index.html'}")


def _compress_for_demo(
    to: float, progress: "Progress", last: "Packing", start: "Packing", done: int
) -> "Iterator[Packing]":
    from jamlab.protocols.compression import go_on

    return go_on(last, start, done, to, 1e-3, progress=progress)


def _describe_demo(out: Path) -> str:
    found = [name for name in ("sp.h5", "dp.h5") if (out / name).exists()]
    return f"kept {' and '.join(found)} in {out}; the same command resumes it" if found else NOTHING
