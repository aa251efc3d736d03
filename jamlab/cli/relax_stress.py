"""`jamlab relax-stress`: stress in time after a step of strain."""

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

_COLUMNS = {"time": ".5g", "modulus": ".6g", "stress": ".6g", "elastic_stress": ".6g", "viscous_stress": ".4g"}
_COLUMNS |= {"pressure": ".5g", "contacts": ".0f"}


def relax_stress(
    file: Packing,
    strain: Annotated[float, typer.Option(help="Strain of the step.")],
    duration: Annotated[float, typer.Option(help="Time, tau_1.")],
    step_time: Annotated[float, typer.Option(help="Time that the step takes, tau_1.")] = 1e-2,
    beta: Beta = 1.0,
    alpha: Alpha = 1.0,
    tau: Tau = 1.0,
    stokes: Stokes = False,
    eta_f: EtaF = 1.0,
    tolerance: Accuracy = 1e-3,
    background: Background = None,
    frame: Frame = -1,
    out: Out = Path("relax-stress.h5"),
    plot: Plot = None,
    csv: Csv = None,
    as_json: Json = False,
) -> None:
    """Strain a packing by a step and follow its stress: the relaxation modulus G(t)."""
    from jamlab.flow.relax_stress import relax_stress as run
    from jamlab.packing.hdf5 import read

    expect_files(file, out, plot, csv)
    law = drag_law(beta, alpha, tau, stokes, eta_f)
    with share_bar("relax") as progress:
        how = {"tolerance": tolerance, "background": background or 0.0, "step_time": step_time}
        found = run(read(file, frame), strain, duration, law, out=out, progress=progress, **how)
    give(found, _COLUMNS, [f"residual stress {found.residual:.5g}"], out, plot, csv, as_json)
