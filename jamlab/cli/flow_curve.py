"""`jamlab flow-curve`: stress of steady flow at several rates."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from jamlab.cli.console import print_stage
from jamlab.cli.flow_options import FlowOptions, flow_command
from jamlab.cli.progress import share_bar

if TYPE_CHECKING:
    from jamlab.flow.steady_flow import FlowCurve

_COLUMNS = {"rates": ".4g", "stress": ".5g", "stress_error": ".1g", "pressure": ".5g", "pressure_error": ".1g"}
_COLUMNS |= {"normal_stress_difference": ".4g", "dissipation": ".4g", "plastic_events": ".3g", "imbalance": ".1e"}
_COLUMNS |= {"steady": ""}


@flow_command(_COLUMNS, out=Path("flow-curve.h5"), tolerance=1e-2)
def flow_curve(
    options: FlowOptions,
    rates: Annotated[list[float], typer.Option("--rate", help="Rate of shear, 1/tau_1; give it several times.")],
    strain: Annotated[float, typer.Option(help="Strain of the average at each rate.")] = 4.0,
    discard: Annotated[float, typer.Option(help="Strain of start-up before.")] = 1.0,
    processes: Annotated[int, typer.Option(help="Rates side by side, each on one core.")] = 1,
    within: Annotated[float | None, typer.Option(help="Refuse rates that will take longer, s.")] = None,
) -> "tuple[FlowCurve, Sequence[str]]":
    """Measure steady flow at several rates, with a Herschel-Bulkley fit; rates in the file are not run again."""
    from jamlab.errors import JamlabError
    from jamlab.flow.flow_curve import flow_curve as run
    from jamlab.flow.flow_plan import plan_flow

    packing, law, how = options.packing(), options.law(), options.accuracy
    if not options.out.exists():
        plan = plan_flow(packing, rates, law, strain=strain + discard, **how)
        if within is not None:
            plan.check(within)
        print_stage(f"about {max(plan.total / processes, plan.seconds.max()):.2g} s")
    with share_bar("flow curve") as progress:
        how |= {"strain": strain, "discard": discard, "processes": processes}
        found = run(packing, rates, law, out=options.out, progress=progress, **how)
    try:
        fit = f"Herschel-Bulkley: {found.herschel_bulkley()}"
    except JamlabError as error:
        fit = f"no Herschel-Bulkley fit: {error}"
    return found, [fit]
