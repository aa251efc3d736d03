"""`jamlab anneal`, `swap-sizes`, `relax-radii`: packings that are more stable than those of a quench."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from jamlab.cli.console import print_packings, progress_bar
from jamlab.cli.interruption import expect_output
from jamlab.cli.option_values import Reading
from jamlab.cli.options import Written, command
from jamlab.storage.atomic_file import check_target

if TYPE_CHECKING:
    from jamlab.packing.packing import Packing

Out = Annotated[Path, Written(("packings",))]


def _write(
    file: Path, frame: int, reading: Any, out: Path, overwrite: bool, json: bool, make: Callable[..., "Packing"]
) -> None:
    """Write what is made of a packing in a file."""
    from jamlab.trajectories.files import read

    check_target(out, replace=overwrite)
    expect_output(out)
    start = read(file, frame, **reading)
    with progress_bar("anneal") as progress:
        packing = make(start, progress)
    print_packings([packing], out, json)


@command("anneal", "read")
def anneal(
    file: Path,
    *,
    temperature: list[float],
    duration: float,
    seed: int,
    pressure: float | None,
    frame: int,
    force_tolerance: float | None,
    reading: Reading,
    out: Out,
    overwrite: bool,
    json: bool,
) -> None:
    """Anneal a packing thermally in LAMMPS, and quench it.

    The unit of time is that of a contact, (m d^2/e)^(1/2). No file is written if interrupted.
    """
    import jamlab

    how: dict[str, Any] = {"seed": seed, "pressure": pressure, "force_tolerance": force_tolerance}
    _write(
        *(file, frame, reading, out, overwrite, json),
        lambda start, progress: jamlab.anneal(start, temperature, duration, progress=progress, **how).packing,
    )


@command("swap_sizes", "read")
def swap_sizes(
    file: Path,
    *,
    temperature: list[float],
    sweeps: int,
    swap_share: float,
    seed: int,
    pressure: float | None,
    frame: int,
    force_tolerance: float | None,
    reading: Reading,
    out: Out,
    overwrite: bool,
    json: bool,
) -> None:
    """Anneal disks by swap Monte Carlo, and quench them.

    The sizes stay the same, in another order. No file is written if interrupted.
    """
    import jamlab

    how: dict[str, Any] = {"seed": seed, "swap_share": swap_share, "pressure": pressure}
    how |= {"force_tolerance": force_tolerance}
    _write(
        *(file, frame, reading, out, overwrite, json),
        lambda start, progress: jamlab.swap_sizes(start, temperature, sweeps, progress=progress, **how).packing,
    )


@command("relax_radii", "read")
def relax_radii(
    file: Path,
    *,
    radius_stiffness: float,
    pressure: float | None,
    frame: int,
    force_tolerance: float | None,
    reading: Reading,
    out: Out,
    overwrite: bool,
    json: bool,
) -> None:
    """Relax disks with radii that may change on the way.

    At the end the sizes are those of before, in another order.
    """
    import jamlab

    how: dict[str, Any] = {"pressure": pressure, "force_tolerance": force_tolerance}
    _write(
        *(file, frame, reading, out, overwrite, json),
        lambda start, _: jamlab.relax_radii(start, radius_stiffness, **how),
    )
