"""`jamlab demo`: both models through jamming, as tables and one page to look through."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from jamlab.cli.console import print_note, print_packings, progress_bars
from jamlab.cli.interruption import expect_output
from jamlab.cli.options import Force, N, Seed
from jamlab.errors import InputError

if TYPE_CHECKING:
    from jamlab.packing.packing import Packing
    from jamlab.processes.progress import Progress

_ONSET = 0.7  # share of a run until onset, in the bar: 0.9 of disks and 0.5 of droplets to rho = 0.95
_LEAD = (
    "From a random start at φ = 0.20 to jamming onset, and from there in steps of 0.001 in ρ to dense packings. "
    "The box is sheared until no shear stress is left, so that no stable state has a negative shear modulus. "
    "The page shows up to 40 states of each model, from onset to the densest; the HDF5 files hold all of them."
)

_SHOWN = 40  # states of each model on the page, at most


def demo(
    n: N = 64,
    seed: Seed = 1,
    to: Annotated[float, typer.Option(help="Last true packing fraction.")] = 0.95,
    out: Annotated[Path, typer.Option(help="Folder for HDF5 and HTML.")] = Path("jamlab-demo"),
    force: Force = False,
) -> None:
    """Take both models from a random start through jamming to rho = 0.95: tables, and one HTML page."""
    import numpy as np

    from jamlab.checks import check_bidisperse, check_number
    from jamlab.figures.explorer.write_page import explorer_fragment, write_sections
    from jamlab.models.models import MODELS
    from jamlab.packing.hdf5 import read_observables
    from jamlab.processes.side_by_side import run_side_by_side
    from jamlab.storage.atomic_file import check_targets, make_folder
    from jamlab.storage.verified_file import versions

    check_bidisperse(n, seed, 1.0)
    check_number("to", to, 1.0)
    make_folder(out)
    check_targets(out, ("index.html", *(f"{name}.h5" for name in MODELS)), replace=force)
    expect_output(out)
    particles = {name: model.particles for name, model in MODELS.items()}
    with progress_bars(particles) as progress:
        run = partial(sweep, n=n, seed=seed, to=to)
        found = run_side_by_side(run, [*MODELS], len(MODELS), report=lambda name, *step: progress[name](*step))
    sections = []
    for name, packings in zip(MODELS, found, strict=True):
        file = out / f"{name}.h5"
        print_packings(packings, file, False)
        kept = np.linspace(0, len(packings) - 1, min(len(packings), _SHOWN)).round().astype(int)
        observables = {column: values[kept] for column, values in read_observables(file).items()}
        shown = explorer_fragment([packings[k] for k in kept], observables=observables)
        sections.append((f"Sweep of {particles[name]}", shown))
    title = "Jamming of disks and deformable polygons"
    write_sections(out / "index.html", title, _LEAD, sections, {"seed": str(seed), **versions()})
    print_note(f"Open {out / 'index.html'}")


def sweep(model: str, report: "Progress", *, n: int, seed: int, to: float) -> "list[Packing]":
    """Take one model from onset to the densest state."""
    from jamlab.protocols.compression import compress
    from jamlab.protocols.onset import jam

    how = {"ensemble": "shear-stabilized", "progress": lambda share, text: report(_ONSET * share, text)}
    onset = jam(model, n, seed, **how)  # type: ignore[arg-type]
    if to <= onset.phi:
        raise InputError(f"to = {to}: {model} with n = {n}, seed = {seed} jams at {onset.phi:.4f}, so go higher")
    return [onset, *compress(onset, to, progress=lambda share, text: report(_ONSET + (1 - _ONSET) * share, text))]
