"""Options shared by several commands."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from jamlab.errors import InputError
from jamlab.storage.atomic_file import check_ending

if TYPE_CHECKING:
    from jamlab.rheology.damping import Damping


def written_as(*kinds: str) -> Callable[..., Path | None]:
    """Check of an option that names a file to write: its ending must belong to one of these formats."""

    def check(param: typer.CallbackParam, path: Path | None) -> Path | None:
        if path is not None:
            check_ending(path, *kinds, option=param.opts[0])
        return path

    return check


Beta = Annotated[float, typer.Option(help="Ratio of tangential to normal damping.")]
Alpha = Annotated[float, typer.Option(help="Exponent of contact damping, 0.4 to 1 (1: linear; 1/2, 2/3: films).")]
Tau = Annotated[float, typer.Option(help="Relaxation time tau_1 of two disks.")]
Stokes = Annotated[bool, typer.Option("--stokes", help="Stokes drag instead of contact damping.")]
EtaF = Annotated[float, typer.Option(help="Viscosity of the fluid for --stokes (k tau_1).")]


def drag_law(stokes: bool, beta: float, alpha: float, tau: float, eta_f: float) -> "Damping":
    """Make the drag law that the options name."""
    from jamlab.rheology.damping import ContactDamping, StokesDrag

    return StokesDrag(eta_f=eta_f, tau=tau) if stokes else ContactDamping(beta=beta, tau=tau, alpha=alpha)


Json = Annotated[bool, typer.Option("--json", help="Print one JSON object instead of a table.")]


def law_values(entries: list[str] | None) -> dict[str, float | str]:
    """Read the entries of `--law`, each NAME=VALUE, as numbers where they are numbers."""
    found: dict[str, float | str] = {}
    for entry in entries or ():
        name, equals, text = entry.partition("=")
        if not (name.isidentifier() and equals and text):
            raise InputError(f"--law {entry}: give it as NAME=VALUE")
        try:
            found[name] = int(text) if text.isdigit() else float(text)
        except ValueError:
            found[name] = text
    return found


Law = Annotated[
    list[str] | None, typer.Option(metavar="NAME=VALUE", help="Parameter of the force law, as gamma=0.3; repeatable.")
]
N = Annotated[int, typer.Option("--n", "-n", help="Number of particles; must be even for the default sizes.")]
Ratio = Annotated[float | None, typer.Option(help="Diameter ratio of large to small disks, 1 to 10 (default: 1.4).")]
Large = Annotated[float, typer.Option(help="Number fraction of large particles.")]
Sizes = Annotated[
    str | None,
    typer.Option(
        metavar="DISTRIBUTION",
        help="Diameters of disks: monodisperse, bidisperse:RATIO,SHARE, uniform:W, gaussian:W, lognormal:W, "
        "power-law:EXP,SMALLEST,LARGEST (W: standard deviation over mean; ,random: drawn at random) or from-file:PATH.",
    ),
]
Seed = Annotated[int, typer.Option(help="Seed of the random start.")]
Out = Annotated[Path, typer.Option("--out", "-o", help="HDF5 file to write (.h5).", callback=written_as("packings"))]
Force = Annotated[bool, typer.Option("--force", help="Replace existing files.")]
File = Annotated[Path, typer.Argument(help="HDF5 file written by jamlab.")]
Ensemble = Annotated[
    str, typer.Option(metavar="{fixed-box,shear-stabilized}", help="Fixed box, or box sheared to zero shear stress.")
]
Frame = Annotated[int, typer.Option(help="Frame of the file; -1: the last.")]
Ranks = Annotated[int, typer.Option(help="Threads per minimisation (disks; useful above 10 000).")]
Tolerance = Annotated[float | None, typer.Option(help="Largest residual force (default: 1e-12, droplets 1e-10).")]
