"""What the commands of flow in time have in common: options of drag, accuracy and files; their beginning and end."""

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, dataclass, fields
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from jamlab.cli.flow_output import expect_files, give
from jamlab.cli.options import Frame, Json, Out

if TYPE_CHECKING:
    from jamlab.flow.read_flow import Flow
    from jamlab.packing.packing import Packing
    from jamlab.rheology.damping import Damping


@dataclass(frozen=True)
class FlowOptions:
    """Options of every command of flow; each name and default is that of the command line."""

    file: Annotated[Path, typer.Argument(help="HDF5 file with a packing of disks or droplets.")]
    beta: Annotated[float, typer.Option(help="Contact damping: coefficient of sliding over that of approach.")] = 1.0
    alpha: Annotated[
        float, typer.Option(help="Contact damping: power of the velocity, 0.4 to 1; films: 0.5, 0.667.")
    ] = 1.0
    tau: Annotated[float, typer.Option(help="Relaxation time tau_1 of two disks.")] = 1.0
    stokes: Annotated[bool, typer.Option("--stokes", help="Stokes drag instead of contact damping.")] = False
    eta_f: Annotated[float, typer.Option(help="Stokes drag: viscosity of the fluid, k tau_1.")] = 1.0
    tolerance: Annotated[float, typer.Option(help="Relative error of velocities in a step.")] = 1e-3
    background: Annotated[
        float | None,
        typer.Option(
            help="Drag of every particle beside contact damping, k tau_1; flow by a rate: disks 1e-4, droplets 1e-2."
        ),
    ] = None
    frame: Frame = -1
    out: Out = Path("flow.h5")
    plot: Annotated[Path | None, typer.Option(help="Picture to write as well: .png, .pdf or .svg.")] = None
    csv: Annotated[Path | None, typer.Option(help="Table of all rows to write as well.")] = None
    as_json: Json = False

    def packing(self) -> "Packing":
        """Packing of the file."""
        from jamlab.packing.hdf5 import read

        return read(self.file, self.frame)

    def law(self) -> "Damping":
        """Drag law."""
        from jamlab.rheology.damping import ContactDamping, StokesDrag

        if self.stokes:
            return StokesDrag(eta_f=self.eta_f, tau=self.tau)
        return ContactDamping(beta=self.beta, tau=self.tau, alpha=self.alpha)

    @property
    def accuracy(self) -> dict[str, Any]:
        """Arguments of every flow; a background that is not given is left to it."""
        return {"tolerance": self.tolerance} | ({} if self.background is None else {"background": self.background})


Run = Callable[..., tuple["Flow", Sequence[str]]]


def flow_command(columns: Mapping[str, str], **other: Any) -> Callable[[Run], Callable[..., None]]:
    """Make a command of a function that takes `FlowOptions` and options of its own, and returns a result and notes.

    Args:
        columns: of the printed table, see `give`.
        other: defaults that differ from those of `FlowOptions`.
    """

    def decorate(run: Run) -> Callable[..., None]:
        _, *own = inspect.signature(run).parameters.values()
        file, *shared = (
            inspect.Parameter(
                f.name,
                inspect.Parameter.POSITIONAL_OR_KEYWORD,
                default=inspect.Parameter.empty if f.default is MISSING else other.get(f.name, f.default),
                annotation=f.type,
            )
            for f in fields(FlowOptions)
        )
        parameters = [file, *own, *shared]

        @wraps(run)
        def command(**values: Any) -> None:
            options = FlowOptions(**{each.name: values.pop(each.name) for each in (file, *shared)})
            expect_files(options.file, options.out, options.plot, options.csv)
            found, notes = run(options, **values)
            give(found, columns, notes, options.out, options.plot, options.csv, options.as_json)

        command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        command.__annotations__ = {each.name: each.annotation for each in parameters}
        return command

    return decorate
