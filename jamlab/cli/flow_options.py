"""Options shared by the commands of flow in time."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from jamlab.rheology.damping import Damping

Packing = Annotated[Path, typer.Argument(help="HDF5 file with a packing of disks.")]
Beta = Annotated[float, typer.Option(help="Contact damping: coefficient of sliding over that of approach.")]
Alpha = Annotated[float, typer.Option(help="Contact damping: power of the velocity, 0.4 to 1; films: 0.5, 0.667.")]
Tau = Annotated[float, typer.Option(help="Relaxation time tau_1 of two disks.")]
Stokes = Annotated[bool, typer.Option("--stokes", help="Stokes drag instead of contact damping.")]
EtaF = Annotated[float, typer.Option(help="Stokes drag: viscosity of the fluid, k tau_1.")]
Background = Annotated[
    float | None, typer.Option(help="Drag of every disk beside contact damping, k tau_1; flow by a rate: 1e-4.")
]
Accuracy = Annotated[float, typer.Option("--tolerance", help="Relative error of velocities in a step.")]
Plot = Annotated[Path | None, typer.Option(help="Picture to write as well: .png, .pdf or .svg.")]
Csv = Annotated[Path | None, typer.Option(help="Table of all rows to write as well.")]


def drag_law(beta: float, alpha: float, tau: float, stokes: bool, eta_f: float) -> "Damping":
    """Drag law of the options."""
    from jamlab.rheology.damping import ContactDamping, StokesDrag

    return StokesDrag(eta_f=eta_f, tau=tau) if stokes else ContactDamping(beta=beta, tau=tau, alpha=alpha)
