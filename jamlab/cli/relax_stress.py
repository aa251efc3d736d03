"""`jamlab relax-stress`: stress in time after a step of strain."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from jamlab.cli.flow_options import FlowOptions, flow_command
from jamlab.cli.progress import share_bar

if TYPE_CHECKING:
    from jamlab.flow.stress_relaxation import StressRelaxation

_COLUMNS = {"time": ".5g", "modulus": ".6g", "stress": ".6g", "elastic_stress": ".6g", "viscous_stress": ".4g"}
_COLUMNS |= {"pressure": ".5g", "contacts": ".0f"}


@flow_command(_COLUMNS, out=Path("relax-stress.h5"))
def relax_stress(
    options: FlowOptions,
    strain: Annotated[float, typer.Option(help="Strain of the step.")],
    duration: Annotated[float, typer.Option(help="Time, tau_1.")],
    step_time: Annotated[float, typer.Option(help="Time that the step takes, tau_1.")] = 1e-2,
) -> "tuple[StressRelaxation, Sequence[str]]":
    """Strain a packing by a step and follow its stress: the relaxation modulus G(t)."""
    from jamlab.flow.relax_stress import relax_stress as run

    how = options.accuracy | {"step_time": step_time, "out": options.out}
    with share_bar("relax") as progress:
        found = run(options.packing(), strain, duration, options.law(), progress=progress, **how)
    return found, [f"residual stress {found.residual:.5g}"]
