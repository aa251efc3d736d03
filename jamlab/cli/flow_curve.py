"""`jamlab flow-curve`: stress of steady flow at several rates."""

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

_COLUMNS = {"rates": ".4g", "stress": ".5g", "stress_error": ".1g", "pressure": ".5g", "pressure_error": ".1g"}
_COLUMNS |= {"normal_stress_difference": ".4g", "dissipation": ".4g", "plastic_events": ".3g", "steady": ""}


def flow_curve(
    file: Packing,
    rates: Annotated[list[float], typer.Option("--rate", help="Rate of shear, 1/tau_1; give it several times.")],
    strain: Annotated[float, typer.Option(help="Strain of the average at each rate.")] = 4.0,
    discard: Annotated[float, typer.Option(help="Strain of start-up before.")] = 1.0,
    processes: Annotated[int, typer.Option(help="Rates side by side, each on one core.")] = 1,
    within: Annotated[float | None, typer.Option(help="Refuse rates that will take longer, s.")] = None,
    beta: Beta = 1.0,
    alpha: Alpha = 1.0,
    tau: Tau = 1.0,
    stokes: Stokes = False,
    eta_f: EtaF = 1.0,
    tolerance: Accuracy = 1e-2,
    background: Background = None,
    frame: Frame = -1,
    out: Out = Path("flow-curve.h5"),
    plot: Plot = None,
    csv: Csv = None,
    as_json: Json = False,
) -> None:
    """Measure steady flow at several rates, with a Herschel-Bulkley fit; rates in the file are not run again."""
    from jamlab.errors import JamlabError
    from jamlab.flow.flow_curve import flow_curve as run
    from jamlab.flow.flow_plan import plan_flow
    from jamlab.packing.hdf5 import read

    expect_files(file, out, plot, csv)
    packing, law = read(file, frame), drag_law(beta, alpha, tau, stokes, eta_f)
    how: dict[str, Any] = {"tolerance": tolerance, "background": background}
    if not out.exists():
        plan = plan_flow(packing, rates, law, strain=strain + discard, **how)
        if within is not None:
            plan.check(within)
        print_stage(f"about {max(plan.total / processes, plan.seconds.max()):.2g} s")
    with share_bar("flow curve") as progress:
        steps: dict[str, Any] = {"strain": strain, "discard": discard, "processes": processes}
        found = run(packing, rates, law, out=out, progress=progress, **how, **steps)
    try:
        fit = f"Herschel-Bulkley: {found.herschel_bulkley()}"
    except JamlabError as error:
        fit = f"no Herschel-Bulkley fit: {error}"
    give(found, _COLUMNS, [fit], out, plot, csv, as_json)
