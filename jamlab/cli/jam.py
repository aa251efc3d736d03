"""`jamlab jam`, `pack` and `compress`: packings at onset, at a pressure, and sweeps above onset."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from jamlab.cli import options
from jamlab.cli.console import print_packings, progress_bar
from jamlab.cli.interruption import KeptStates, expect_output
from jamlab.errors import InputError, StorageError
from jamlab.storage.atomic_file import check_target

if TYPE_CHECKING:
    from jamlab.packing.packing import Packing


def jam(
    model: Annotated[str, typer.Option(help="sp (disks) or dp (droplets).")] = "sp",
    n: options.N = 64,
    seed: options.Seed = 1,
    contact: Annotated[str | None, typer.Option(help="Contact form (dp): outline, segment or segment/smooth.")] = None,
    gamma: Annotated[float | None, typer.Option(help="Line tension (dp), eps/l; default 0.4.")] = None,
    ka: Annotated[float | None, typer.Option(help="Area stiffness (dp), eps/l^4; default 300.")] = None,
    delta: Annotated[float | None, typer.Option(help="Width of the rims (dp), l; default 0.25.")] = None,
    law: options.Law = None,
    ratio: options.Ratio = None,
    large: options.Large = 0.5,
    sizes: options.Sizes = None,
    search: Annotated[str, typer.Option(help="bisection, or paper: steps of 1e-4 throughout.")] = "bisection",
    ensemble: options.Ensemble = "fixed-box",
    ranks: options.Ranks = 1,
    tolerance: options.Tolerance = None,
    out: options.Out = Path("onset.h5"),
    force: options.Force = False,
    as_json: options.Json = False,
) -> None:
    """Make a packing at jamming onset, after Boromand et al., section 2.3.

    No file is written if interrupted: intermediate states are not at onset.
    """
    import jamlab

    check_target(out, replace=force)
    expect_output(out)
    given = {"contact": contact, "gamma": gamma, "ka": ka, "delta": delta}
    how: dict[str, Any] = {"ratio": ratio, "large": large, "sizes": sizes, "search": search, "ensemble": ensemble}
    how |= {"ranks": ranks, "tolerance": tolerance, **options.law_values(law)}
    how |= {name: value for name, value in given.items() if value is not None}
    with progress_bar("to onset") as progress:
        packing = jamlab.jam(model, n, seed, progress=progress, **how)
    print_packings([packing], out, as_json)


def pack(
    pressure: Annotated[float, typer.Option(help="Target pressure, in units of k.")],
    n: options.N = 256,
    seed: options.Seed = 1,
    ensemble: options.Ensemble = "fixed-box",
    ranks: options.Ranks = 1,
    law: options.Law = None,
    ratio: options.Ratio = None,
    large: options.Large = 0.5,
    sizes: options.Sizes = None,
    tolerance: options.Tolerance = None,
    out: options.Out = Path("packing.h5"),
    force: options.Force = False,
    as_json: options.Json = False,
) -> None:
    """Make a packing of disks at a target pressure, with the force law and units of Baumgarten & Tighe.

    No file is written if interrupted: intermediate states have other pressures.
    """
    import jamlab

    check_target(out, replace=force)
    expect_output(out)
    how: dict[str, Any] = {"ratio": ratio, "large": large, "sizes": sizes, "ensemble": ensemble}
    how |= {"ranks": ranks, "tolerance": tolerance, **options.law_values(law)}
    with progress_bar("to pressure") as progress:
        packing = jamlab.pack(n, pressure, seed, progress=progress, **how)
    print_packings([packing], out, as_json)


def compress(
    file: options.File,
    to: Annotated[float, typer.Option(help="Last packing fraction.")],
    step: Annotated[float, typer.Option(help="Distance between two states.")] = 0.01,
    by: Annotated[str, typer.Option(help="rho (true) or phi (nominal packing fraction).")] = "rho",
    nearest: Annotated[float | None, typer.Option(help="First step; log-spaced from there on.")] = None,
    error: Annotated[float | None, typer.Option(help="Adapt steps to this relative error of pressure.")] = None,
    frame: options.Frame = -1,
    ranks: options.Ranks = 1,
    tolerance: options.Tolerance = None,
    out: options.Out = Path("sweep.h5"),
    force: options.Force = False,
    as_json: options.Json = False,
) -> None:
    """Compress or decompress a packing in steps; the first frame written is the start. The same command resumes a
    sweep that was interrupted."""
    from jamlab.packing.hdf5 import read
    from jamlab.protocols.compression import compress as run

    check_target(out, file)
    start = read(file, frame)
    begun = [] if force else _begun(out, start, to)
    kept, how = KeptStates(out, begun), {"nearest": nearest, "error": error, "ranks": ranks, "tolerance": tolerance}
    with kept, progress_bar("compress") as progress:
        if not begun:
            kept.add(start)
        try:
            sweep = run(start, to, step, by=by, progress=progress, after=begun[1:], **how)  # type: ignore[arg-type]
        except InputError as error_:
            if not begun:
                raise
            remedy = "choose another name, or give --force to replace it"
            raise StorageError(f"{out} exists, and this command does not resume it: {error_}; {remedy}") from error_
        for state in sweep:
            kept.add(state)
    print_packings(kept.states, out, as_json)


def _begun(out: Path, start: "Packing", to: float) -> "list[Packing]":
    """States of a sweep from this start that a file holds, if it was interrupted; none if there is no file."""
    from jamlab.packing.hdf5 import read_all, read_observables

    if not out.exists():
        return []
    try:
        states = read_all(out)
    except StorageError:
        states = []
    same = states and states[0].difference(start) is None and states[0].positions.tobytes() == start.positions.tobytes()
    whole = same and states[-1].provenance.get("target") == to and read_observables(out)
    if not same or len(states) < 2 or whole:
        check_target(out, replace=False)
    return states
