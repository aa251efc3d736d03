"""`jamlab oscillate`: storage and loss at any amplitude."""

from pathlib import Path
from typing import Annotated

import typer

from jamlab.cli.flow_options import (
    Accuracy,
    Alpha,
    Background,
    Beta,
    Csv,
    EtaF,
    Packing,
    Plot,
    Stokes,
    Tau,
    drag_law,
)
from jamlab.cli.flow_output import expect_files, give
from jamlab.cli.options import Frame, Json, Out
from jamlab.cli.progress import share_bar

_COLUMNS = {"time": ".5g", "strain": ".4g", "stress": ".6g", "elastic_stress": ".6g", "viscous_stress": ".5g"}
_COLUMNS |= {"pressure": ".5g", "contacts": ".0f"}


def oscillate(
    file: Packing,
    omega: Annotated[float, typer.Option(help="Angular frequency, 1/tau_1.")],
    amplitude: Annotated[float, typer.Option(help="Amplitude of the strain.")],
    cycles: Annotated[int, typer.Option(help="Cycles at most; it ends when the answer repeats.")] = 20,
    points: Annotated[int, typer.Option(help="Rows in a cycle.")] = 32,
    beta: Beta = 1.0,
    alpha: Alpha = 1.0,
    tau: Tau = 1.0,
    stokes: Stokes = False,
    eta_f: EtaF = 1.0,
    tolerance: Accuracy = 1e-3,
    background: Background = None,
    frame: Frame = -1,
    out: Out = Path("oscillate.h5"),
    plot: Plot = None,
    csv: Csv = None,
    as_json: Json = False,
) -> None:
    """Shear a packing to and fro: harmonics of the stress; the picture is the Lissajous figure."""
    from jamlab.flow.oscillate import oscillate as run
    from jamlab.packing.hdf5 import read

    expect_files(file, out, plot, csv)
    packing, law = read(file, frame), drag_law(beta, alpha, tau, stokes, eta_f)
    with share_bar("oscillate") as progress:
        how = {"tolerance": tolerance, "background": background or 0.0}
        found = run(packing, omega, amplitude, law, cycles=cycles, points=points, out=out, progress=progress, **how)
    notes = [f"G' = {found.storage:.6g}, G'' = {found.loss:.6g}; |G*_3|/|G*_1| = {found.third_over_first:.2g}"]
    give(found, _COLUMNS, notes, out, plot, csv, as_json)
