"""Options shared by several commands."""

from collections.abc import Callable
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from jamlab.errors import InputError
from jamlab.storage.formats import check_ending

if TYPE_CHECKING:
    from jamlab.rheology.drag_law import DragLaw


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
Drag = Annotated[
    str | None,
    typer.Option(
        metavar="NAME:PARAMETER=VALUE,...",
        help="Any drag law by name, as contact:lever_arms=contact; also one of an installed package.",
    ),
]


def drag_law(drag: str | None, stokes: bool, beta: float, alpha: float, tau: float, eta_f: float) -> "DragLaw":
    """Make the drag law that the options name."""
    from jamlab.rheology.drag_law import make_law

    if drag is not None:
        name, _, numbers = drag.partition(":")
        return make_law(name, _named_values("--drag", numbers.split(",") if numbers else []))
    if stokes:
        return make_law("stokes", {"eta_f": eta_f, "tau": tau})
    return make_law("contact", {"beta": beta, "tau": tau, "alpha": alpha})


Json = Annotated[bool, typer.Option("--json", help="Print one JSON object instead of a table.")]


def law_values(entries: list[str] | None, function: Callable[..., Any]) -> dict[str, float | str]:
    """Read the entries of `--law`, each NAME=VALUE, as numbers where they are numbers; they go to a function, whose
    own arguments are no parameters of the force law."""
    own = signature(function).parameters.keys() - {"law"}  # by which a law of another package is named
    found = _named_values("--law", entries or [])
    for name in found:
        if name in own:
            entry = next(each for each in entries or () if each.partition("=")[0] == name)
            raise InputError(f"--law {entry}: {name} is no parameter of the force law, such as exponent")
    return found


def _named_values(option: str, entries: list[str]) -> dict[str, float | str]:
    """Read entries NAME=VALUE of an option, as numbers where they are numbers."""
    found: dict[str, float | str] = {}
    for entry in entries:
        name, equals, text = entry.partition("=")
        if not (name.isidentifier() and equals and text):
            raise InputError(f"{option} {entry}: give it as NAME=VALUE")
        if name in found:
            raise InputError(f"{option} {entry}: {name} is given twice; give one value")
        found[name] = _number_or_text(text)
    return found


def _number_or_text(text: str) -> float | str:
    try:
        return int(text) if text.isdigit() else float(text)
    except ValueError:
        return text


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
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace existing files.")]
File = Annotated[Path, typer.Argument(help="HDF5 file written by jamlab.")]
EnsembleOption = Annotated[
    str, typer.Option(metavar="{fixed-box,shear-stabilized}", help="Fixed box, or box sheared to zero shear stress.")
]
AnyFile = Annotated[
    Path, typer.Argument(help="File of jamlab, LAMMPS (.data, .dump), GSD, extended xyz or a table of disks (.csv).")
]
FrameOption = Annotated[int, typer.Option(help="Frame of the file; -1: the last.")]
Ranks = Annotated[int, typer.Option(help="Threads per minimisation (disks; useful above 10 000).")]
Tolerance = Annotated[float | None, typer.Option(help="Largest residual force (default: 1e-12, droplets 1e-10).")]
Units = Annotated[str | None, typer.Option(metavar="{eps,k}", help="Units, if the file does not state them.")]
Box = Annotated[
    str | None, typer.Option(metavar="LX,LY", help="Sides of the box, or both lattice vectors, AX,AY,BX,BY.")
]
Radii = Annotated[
    str | None, typer.Option(metavar="RADIUS", help="Radius of all disks, or of each type, as in 1=0.5,2=0.7.")
]


Kind = Annotated[
    str | None, typer.Option(metavar="{sp,dp}", help="Disks (sp) or droplets (dp), if the file does not state it.")
]
Style = Annotated[str | None, typer.Option(metavar="STYLE", help="Atom style of a LAMMPS data file without one.")]


def how_to_read(
    units: Units = None,
    box: Box = None,
    radii: Radii = None,
    law: Law = None,
    model: Kind = None,
    atom_style: Style = None,
) -> dict[str, Any]:
    """Arguments of `jamlab.read` that say what files of other programs lack."""
    import jamlab

    how: dict[str, Any] = {"units": units, "law": law_values(law, jamlab.read) or None, "atom_style": atom_style}
    how["model"] = model
    if box is not None:
        how["box"] = lattice(box)
    if radii is not None:
        by_type = [part.partition("=") for part in radii.split(",")]
        if len(by_type) == 1 and not by_type[0][1]:
            how["radii"] = _number("--radii", radii, radii)
        elif len({kind for kind, *_ in by_type}) < len(by_type) or not all(equals for _, equals, _ in by_type):
            raise InputError(f"--radii {radii}: give one number, or one for each type, as 1=0.5,2=0.7")
        else:
            how["radii"] = {kind.strip(): _number("--radii", radii, text) for kind, _, text in by_type}
    return {name: value for name, value in how.items() if value is not None}


def lattice(box: str) -> list[Any]:
    """Read `--box`, two sides or two lattice vectors."""
    sides = [_number("--box", box, text) for text in box.split(",")]
    if len(sides) not in (2, 4):
        raise InputError(f"--box {box}: give two sides, as 12.5,12.5, or two lattice vectors, as 12.5,0,0.3,12.5")
    return sides if len(sides) == 2 else [sides[:2], sides[2:]]


def _number(option: str, given: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{option} {given}: {text!r} is no number") from None


def reads_any_file(function: Callable[..., None]) -> Callable[..., None]:
    """Add the options of `how_to_read` to a command, which gets what they say as its argument `reading`."""
    shared = signature(how_to_read).parameters

    def call(**given: Any) -> None:
        reading = how_to_read(**{name: given.pop(name) for name in shared})
        function(reading=reading, **given)

    own = [each for each in signature(function).parameters.values() if each.name != "reading"]
    made: Callable[..., None] = with_parameters(call, function, [*own, *shared.values()])
    return made


def with_parameters(call: Callable[..., None], function: Callable[..., None], each: list[Parameter]) -> Any:
    """Let a command be known by the name and text of a function, and have some parameters."""
    parameters = [one.replace(kind=one.KEYWORD_ONLY) for one in each]
    call.__name__, call.__doc__ = function.__name__, function.__doc__
    call.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    call.__annotations__ = {one.name: one.annotation for one in parameters}
    return call
