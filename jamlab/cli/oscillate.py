"""`jamlab oscillate`: storage and loss at any amplitude."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from jamlab.cli.flow_options import FlowOptions, flow_command
from jamlab.cli.progress import share_bar

if TYPE_CHECKING:
    from jamlab.flow.oscillation import Oscillation

_COLUMNS = {"time": ".5g", "strain": ".4g", "stress": ".6g", "elastic_stress": ".6g", "viscous_stress": ".5g"}
_COLUMNS |= {"pressure": ".5g", "contacts": ".0f"}


@flow_command(_COLUMNS, out=Path("oscillate.h5"))
def oscillate(
    options: FlowOptions,
    omega: Annotated[float, typer.Option(help="Angular frequency, 1/tau_1.")],
    amplitude: Annotated[float, typer.Option(help="Amplitude of the strain.")],
    cycles: Annotated[int, typer.Option(help="Cycles at most; it ends when the answer repeats.")] = 20,
    points: Annotated[int, typer.Option(help="Rows in a cycle.")] = 32,
) -> "tuple[Oscillation, Sequence[str]]":
    """Shear a packing to and fro: harmonics of the stress; the picture is the Lissajous figure."""
    from jamlab.flow.oscillate import oscillate as run

    how = options.accuracy | {"cycles": cycles, "points": points, "out": options.out}
    with share_bar("oscillate") as progress:
        found = run(options.packing(), omega, amplitude, options.law(), progress=progress, **how)
    return found, [f"G' = {found.storage:.6g}, G'' = {found.loss:.6g}; |G*_3|/|G*_1| = {found.third_over_first:.2g}"]
