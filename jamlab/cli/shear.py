"""`jamlab shear`: start-up of shear at a constant rate."""

from pathlib import Path
from typing import Annotated, Any

import typer

from jamlab.cli.console import print_stage
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

_COLUMNS = {"strain": ".4g", "time": ".5g", "stress": ".5g", "elastic_stress": ".5g", "viscous_stress": ".4g"}
_COLUMNS |= {"pressure": ".5g", "normal_stress_difference": ".4g", "dissipation": ".4g", "contacts": ".0f"}


def shear(
    file: Packing,
    rate: Annotated[float, typer.Option(help="Rate of shear, 1/tau_1; 0: quasi-static.")],
    strain: Annotated[float, typer.Option(help="Strain at the end.")] = 1.0,
    step: Annotated[float, typer.Option(help="Rate 0: strain between two minima.")] = 1e-4,
    rows: Annotated[int, typer.Option(help="Rows of the result.")] = 200,
    frames: Annotated[float | None, typer.Option(help="Strain between two packings that are kept.")] = None,
    within: Annotated[float | None, typer.Option(help="Refuse a run that will take longer, s.")] = None,
    beta: Beta = 1.0,
    alpha: Alpha = 1.0,
    tau: Tau = 1.0,
    stokes: Stokes = False,
    eta_f: EtaF = 1.0,
    tolerance: Accuracy = 1e-2,
    background: Background = None,
    frame: Frame = -1,
    out: Out = Path("shear.h5"),
    plot: Plot = None,
    csv: Csv = None,
    as_json: Json = False,
) -> None:
    """Shear a packing at a constant rate, without inertia; a run that was interrupted goes on from its file."""
    from jamlab.flow.flow_plan import plan_flow
    from jamlab.flow.shear import shear as run
    from jamlab.packing.hdf5 import read

    expect_files(file, out, plot, csv)
    packing, law = read(file, frame), drag_law(beta, alpha, tau, stokes, eta_f)
    if rate > 0 and not out.exists():
        plan = plan_flow(packing, [rate], law, strain=strain, tolerance=tolerance, background=background)
        if within is not None:
            plan.check(within)
        print_stage(f"about {plan.total:.2g} s")
    with share_bar("shear") as progress:
        how: dict[str, Any] = {"tolerance": tolerance, "background": background, "frames": frames}
        found = run(packing, rate, strain, law, step=step, rows=rows, out=out, progress=progress, **how)
    notes = [f"plastic events seen: {found.plastic_events}; {len(found.frames)} packings; {found.steps} steps"]
    give(found, _COLUMNS, notes, out, plot, csv, as_json)
