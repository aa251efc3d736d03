"""`jamlab shear`: start-up of shear at a constant rate."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from jamlab.cli.console import print_stage
from jamlab.cli.flow_options import FlowOptions, flow_command
from jamlab.cli.progress import share_bar

if TYPE_CHECKING:
    from jamlab.flow.shear_run import ShearRun

_COLUMNS = {"strain": ".4g", "time": ".5g", "stress": ".5g", "elastic_stress": ".5g", "viscous_stress": ".4g"}
_COLUMNS |= {"pressure": ".5g", "normal_stress_difference": ".4g", "dissipation": ".4g", "contacts": ".0f"}


@flow_command(_COLUMNS, out=Path("shear.h5"), tolerance=1e-2)
def shear(
    options: FlowOptions,
    rate: Annotated[float, typer.Option(help="Rate of shear, 1/tau_1; 0: quasi-static.")],
    strain: Annotated[float, typer.Option(help="Strain at the end.")] = 1.0,
    step: Annotated[float, typer.Option(help="Rate 0: strain between two minima.")] = 1e-4,
    rows: Annotated[int, typer.Option(help="Rows of the result.")] = 200,
    frames: Annotated[float | None, typer.Option(help="Strain between two packings that are kept.")] = None,
    within: Annotated[float | None, typer.Option(help="Refuse a run that will take longer, s.")] = None,
) -> "tuple[ShearRun, Sequence[str]]":
    """Shear a packing at a constant rate, without inertia; a run that was interrupted goes on from its file."""
    from jamlab.flow.flow_plan import plan_flow
    from jamlab.flow.shear import shear as run

    packing, law, how = options.packing(), options.law(), options.accuracy
    if rate > 0 and not options.out.exists():
        plan = plan_flow(packing, [rate], law, strain=strain, **how)
        if within is not None:
            plan.check(within)
        print_stage(f"about {plan.total:.2g} s")
    with share_bar("shear") as progress:
        how |= {"step": step, "rows": rows, "frames": frames}
        found = run(packing, rate, strain, law, out=options.out, progress=progress, **how)
    return found, [f"plastic events seen: {found.plastic_events}; {len(found.frames)} packings; {found.steps} steps"]
