"""`jamlab creep`: strain in time under a constant stress."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from jamlab.cli.flow_options import FlowOptions, flow_command
from jamlab.cli.progress import share_bar

if TYPE_CHECKING:
    from jamlab.flow.creep_run import CreepRun

_COLUMNS = {"time": ".5g", "strain": ".5g", "compliance": ".6g", "rate": ".4g", "elastic_stress": ".5g"}
_COLUMNS |= {"viscous_stress": ".4g", "pressure": ".5g", "contacts": ".0f"}


@flow_command(_COLUMNS, out=Path("creep.h5"))
def creep(
    options: FlowOptions,
    stress: Annotated[float, typer.Option(help="Stress beside the residual one, in units of the packing.")],
    duration: Annotated[float, typer.Option(help="Time, tau_1.")],
    largest_strain: Annotated[float, typer.Option(help="Strain at which it ends early.")] = 10.0,
) -> "tuple[CreepRun, Sequence[str]]":
    """Load a packing with a shear stress and follow its strain; says whether it comes to rest, creeps on or flows."""
    from jamlab.flow.creep import creep as run

    how = options.accuracy | {"largest_strain": largest_strain, "out": options.out}
    with share_bar("creep") as progress:
        found = run(options.packing(), stress, duration, options.law(), progress=progress, **how)
    return found, [f"residual stress {found.residual:.5g}"]
