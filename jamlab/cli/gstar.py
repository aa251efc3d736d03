"""`jamlab gstar`: the complex shear modulus, on the screen and as a picture or a table.

A table holds frequency, storage and loss modulus under the names by which pyRheo and rheojax know them, separated by
commas (.csv) or tabs (.tsv); the curves of several kinds of packings stand below each other, behind a column `Kind`.
The window of pyRheo takes tabs alone; rheojax finds separator and columns by itself, but takes a further column whose
name holds one of these for the column itself.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from jamlab.arguments.choices import SpectrumMethod
from jamlab.cli.console import print_json, print_line, print_note, print_table
from jamlab.cli.interruption import expect_output
from jamlab.cli.option_values import Damping, Direction, Making, Reading
from jamlab.cli.options import Written, command
from jamlab.errors import InputError
from jamlab.storage.atomic_file import check_target
from jamlab.storage.table_file import write_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from jamlab.rheology.mean_spectrum import MeanSpectra, MeanSpectrum

_HEADINGS = {"omega": "ω τ1", "storage": "G'", "loss": "G''", "error_bound": "error bound"}
_HEADINGS |= {"storage_stderr": "± G'", "loss_stderr": "± G''"}
_CURVES = ("storage", "loss", "error_bound")


@command("read", "mean_spectra", "pack")
def gstar(
    files: list[Path] | None,
    *,
    n: int | None,
    pressure: float | None,
    phi: float | None,
    seed: int,
    making: Making,
    frame: int,
    reading: Reading,
    damping: Damping,
    direction: Direction,
    prestress: bool,
    method: SpectrumMethod,
    omega_min: float,
    omega_max: float,
    points: int,
    out: Annotated[Path | None, Written(("picture", "table", "tabs"))],
    overwrite: bool,
    json: bool,
) -> None:
    """Compute the complex shear modulus G*(omega).

    Of the packings of FILES, or of one of --n disks at --pressure or --phi, see `jamlab pack`. The static G, averaged
    over directions, is printed too. Packings that differ in more than their random start, such as in pressure, force
    law, sizes or ensemble, are averaged kind by kind.
    """
    import numpy as np

    from jamlab.protocols.target_pressure import pack
    from jamlab.rheology.mean_spectrum import mean_spectra
    from jamlab.trajectories.files import read

    if not files and n is None:
        raise InputError("no packing is given: give FILES, or --n and --pressure or --phi of a packing to make")
    if not files and (pressure is None) == (phi is None):
        raise InputError("give --pressure or --phi, one of them")
    if omega_min >= omega_max:
        raise InputError(f"--omega-min {omega_min:g}: must be below --omega-max {omega_max:g}")
    if out is not None:
        check_output(out, replace=overwrite)
        expect_output(out)
    packings = (
        [read(file, frame, **reading) for file in files]
        if files
        else [pack(int(n or 0), pressure, seed, phi=phi, **making)]
    )
    omega = np.geomspace(omega_min, omega_max, points)
    how: dict[str, Any] = {"direction": direction, "prestress": prestress, "method": method}
    found = mean_spectra(packings, omega, damping, **how)
    if out is not None:
        save(found, out)
    if json:
        curves = [_summary(spectrum) for spectrum in found]
        print_json(curves[0] if len(curves) == 1 else {"curves": curves})
        return
    print_spectra(found)
    if out is not None:
        print_line(f"wrote {out}")


def _summary(spectrum: "MeanSpectrum") -> dict[str, Any]:
    """Plain numbers: limits and mean curves, of each packing too if there are several."""
    from jamlab.rheology.mean_spectrum import LIMITS

    each = spectrum.packings
    content: dict[str, Any] = {"kind": spectrum.kind, "units": spectrum.units}
    content |= {"converged": bool(each["converged"].all()), "method": spectrum.method}
    along = "along x of the box" if spectrum.direction == "simple" else f"in the direction {spectrum.direction}"
    content |= {"shear": f"storage, loss, g0, eta0, eta_inf: shear {along}; g: mean over directions"}
    content["omega"] = spectrum.omega.tolist()
    content |= {name: float(each[name].mean()) for name in ("g", *LIMITS)}
    content |= {name: getattr(spectrum, name).tolist() for name in _CURVES}
    if len(each) > 1:
        numbers = each[["packing", "g", *LIMITS]].to_dict("records")
        curves = [{name: getattr(own, name).tolist() for name in _CURVES} for own in spectrum.spectra]
        content["packings"] = [row | own for row, own in zip(numbers, curves, strict=True)]
    return content


def print_spectra(spectra: "MeanSpectra") -> None:
    """Print G*(omega) of each kind, below it its limits and the static G averaged over directions."""
    along = "_xy" if spectra[0].direction == "simple" else ""
    for spectrum in spectra:
        each, table = spectrum.packings, spectrum.to_dataframe().dropna(axis="columns", how="all")
        count, bad = len(each), int((~each["converged"]).sum())
        kind = f"{spectrum.kind}; " * (len(spectra) > 1)
        title = f"{spectra.damping}; {kind}{count} packing{'s' * (count > 1)}, {spectrum.method}"
        lines = [[f"{value:.4g}" for value in row] for row in table.to_numpy()]
        print_table(title + f", {bad} NOT CONVERGED" * bool(bad), [_heading(str(name), along) for name in table], lines)
        mean = each[["g0", "g", "eta0", "eta_inf"]].mean()
        over = f"; G = {mean['g']:.5g}: static, mean over directions" if mean["g"] == mean["g"] else ""  # none: walls
        where = "shear along x of the box" if along else "the same direction"
        print_note(f"G{along} = {mean['g0']:.5g}: static, for {where}, as G*{over}")
        print_note(f"eta0 = {mean['eta0']:.5g}, eta_inf = {mean['eta_inf']:.5g}")


def _heading(name: str, along: str) -> str:
    return _HEADINGS[name] + along * ("'" in _HEADINGS[name])


def check_output(path: Path, *, replace: bool = True) -> None:
    """Check that a path has a suffix and can be written; an existing file only with `replace`."""
    if not path.suffix:
        raise InputError(f"cannot tell what to write to {path}: end its name in .png or .csv")
    check_target(path, replace=replace)


def save(spectra: "MeanSpectra", path: Path) -> None:
    """Write a picture (.png, .pdf, .svg) or a table (.csv, .tsv), all or nothing."""
    if path.suffix.lower() in (".csv", ".tsv"):
        names = ["omega", "storage", "loss"] if len(spectra) == 1 else ["kind", "omega", "storage", "loss"]
        headers = dict(
            zip(
                ("kind", "omega", "storage", "loss"),
                ("Kind", "Angular Frequency", "Storage Modulus", "Loss Modulus"),
                strict=True,
            )
        )
        write_table(spectra.to_dataframe()[names].rename(columns=headers), path)
    else:
        from jamlab.figures.save_picture import save_picture

        save_picture(modulus_figure(spectra), path)


def modulus_figure(spectra: "MeanSpectra") -> "Figure":
    """Draw storage (solid, filled) and loss modulus (dashed, open) over frequency, log-log: mean and standard error."""
    from matplotlib.figure import Figure

    from jamlab.plotting.drawable import CURVES

    figure = Figure(figsize=CURVES, layout="constrained")
    spectra.plot(figure.subplots())
    return figure
