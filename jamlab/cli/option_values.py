"""What options mean that are written in a form of their own: laws, boxes, directions, and what a foreign file lacks."""

from math import radians
from typing import TYPE_CHECKING, Annotated, Any, cast

from jamlab.arguments.choices import ShearName
from jamlab.cli.options import MadeBy
from jamlab.errors import InputError

if TYPE_CHECKING:
    from jamlab.rheology.drag_law import DragLaw


def read_law(*, law: list[str] | None) -> str | dict[str, float | str] | None:
    """The force law: a name, or parameters by name, or both."""
    name, values = _name_and_values("--law", law or [])
    if name is None or not values:
        return name or values or None
    if "law" in values:
        raise InputError(f"--law law={values['law']}: the law is named already, by --law {name}; leave one out")
    return {"law": name, **values}


def read_damping(*, damping: list[str] | None) -> "DragLaw | None":
    """The drag law: a name, or parameters by name, or both; contact damping if it has no name."""
    from jamlab.rheology.drag_law import make_law

    if not damping:
        return None
    name, values = _name_and_values("--damping", damping)
    return make_law(name or "contact", values)


def _name_and_values(option: str, entries: list[str]) -> tuple[str | None, dict[str, float | str]]:
    """Entries of an option, a name or PARAMETER=VALUE each, in any order."""
    names = [entry for entry in entries if "=" not in entry]
    if len(names) > 1:
        raise InputError(f"{option} {names[1]}: a law is named already, by {option} {names[0]}; leave one out")
    return (names[0] if names else None), _named_values(option, [entry for entry in entries if "=" in entry])


def _named_values(option: str, entries: list[str]) -> dict[str, float | str]:
    """Entries NAME=VALUE of an option, as numbers where they are numbers."""
    found: dict[str, float | str] = {}
    for entry in entries:
        name, _, text = entry.partition("=")
        if not (name.isidentifier() and text):
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


def read_box(*, box: str | None) -> list[Any] | None:
    """Two sides or two lattice vectors of a box."""
    if box is None:
        return None
    sides = [_number("--box", box, text) for text in box.split(",")]
    if len(sides) not in (2, 4):
        raise InputError(f"--box {box}: give two sides, as 12.5,12.5, or two lattice vectors, as 12.5,0,0.3,12.5")
    return sides if len(sides) == 2 else [sides[:2], sides[2:]]


def read_radii(*, radii: str | None) -> float | dict[str, float] | None:
    """One radius of all disks, or one of each type."""
    if radii is None:
        return None
    by_type = [part.partition("=") for part in radii.split(",")]
    if len(by_type) == 1 and not by_type[0][1]:
        return _number("--radii", radii, radii)
    if len({kind for kind, *_ in by_type}) < len(by_type) or not all(equals for _, equals, _ in by_type):
        raise InputError(f"--radii {radii}: give one number, or one for each type, as 1=0.5,2=0.7")
    return {kind.strip(): _number("--radii", radii, text) for kind, _, text in by_type}


def _number(option: str, given: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{option} {given}: {text!r} is no number") from None


def read_direction(*, direction: str) -> ShearName | float:
    """A direction of shear by name, or an angle in radians or, with deg behind it, in degrees."""
    try:
        return radians(float(direction.removesuffix("deg"))) if direction.endswith("deg") else float(direction)
    except ValueError:
        return cast(ShearName, direction)  # which who takes it checks


def read_held_pressure(*, pressure: str | None) -> str | float | None:
    """A pressure that is held while a packing is sheared: a number, or "constant"."""
    return None if pressure is None else _number_or_text(pressure)


def read_bins(*, bins: str | None) -> list[float] | None:
    """Edges of bins."""
    return None if bins is None else [_number("--bins", bins, text) for text in bins.split(",")]


def read_share(*, share: str) -> tuple[int, int]:
    """Which tasks of a campaign are run: K/N."""
    k, slash, n = share.partition("/")
    if not (slash and k.isdecimal() and n.isdecimal()):
        raise InputError(f"--share {share}: give K/N, such as 3/32")
    return int(k), int(n)


Law = Annotated[str | dict[str, float | str] | None, MadeBy(read_law)]
Damping = Annotated["DragLaw | None", MadeBy(read_damping)]
Box = Annotated[list[Any], MadeBy(read_box)]
Direction = Annotated[ShearName | float, MadeBy(read_direction)]
Bins = Annotated[list[float] | None, MadeBy(read_bins)]
Share = Annotated[tuple[int, int], MadeBy(read_share)]
HeldPressure = Annotated[str | float | None, MadeBy(read_held_pressure, "{constant,VALUE}")]


def how_to_read(
    *,
    units: str | None,
    box: Annotated[list[Any] | None, MadeBy(read_box)],
    radii: Annotated[Any, MadeBy(read_radii)],
    law: Law,
    model: str | None,
    atom_style: str | None,
) -> dict[str, Any]:
    """Arguments of `jamlab.read` that say what files of other programs lack."""
    how = {"units": units, "box": box, "radii": radii, "law": law, "model": model, "atom_style": atom_style}
    return {name: value for name, value in how.items() if value is not None}


def how_to_make(
    *,
    law: Law,
    sizes: str | None,
    size_ratio: float | None,
    fraction_large: float,
    units: str | None,
    ensemble: str,
    force_tolerance: float | None,
    ranks: int,
) -> dict[str, Any]:
    """Arguments that `jamlab.jam` and `jamlab.pack` share."""
    how: dict[str, Any] = {"law": law, "sizes": sizes, "size_ratio": size_ratio, "fraction_large": fraction_large}
    return how | {"units": units, "ensemble": ensemble, "force_tolerance": force_tolerance, "ranks": ranks}


Reading = Annotated[dict[str, Any], MadeBy(how_to_read)]
Making = Annotated[dict[str, Any], MadeBy(how_to_make)]
