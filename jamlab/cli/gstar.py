"""`jamlab gstar`: the complex shear modulus, on the screen and as a picture or a table.

A table holds frequency, storage and loss modulus under the names by which pyRheo and rheojax know them, separated by
commas (.csv) or tabs (.tsv); the curves of several kinds of packings stand below each other, behind a column `Kind`.
The window of pyRheo takes tabs alone; rheojax finds separator and columns by itself, but takes a further column whose
name holds one of these for the column itself.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from jamlab.cli.console import print_json, print_line, print_note, print_table
from jamlab.cli.interruption import expect_output
from jamlab.cli.options import (
    Alpha,
    Beta,
    Drag,
    EnsembleOption,
    EtaF,
    FrameOption,
    Json,
    Overwrite,
    Seed,
    Stokes,
    Tau,
    drag_law,
    reads_any_file,
)
from jamlab.errors import InputError
from jamlab.storage.atomic_file import check_target
from jamlab.storage.formats import check_ending
from jamlab.storage.table_file import write_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from jamlab.arrays import Array
    from jamlab.rheology.mean_spectrum import MeanSpectra, MeanSpectrum

SHEAR = "storage, loss, g0, eta0, eta_inf: shear along x of the box; g: mean over directions"
_HEADINGS = {"omega": "ω τ1", "storage": "G'_xy", "loss": "G''_xy", "error_bound": "error"}
_HEADINGS |= {"storage_stderr": "± G'_xy", "loss_stderr": "± G''_xy"}
_CURVES = ("storage", "loss", "error_bound")
MOST_POINTS = 100_000  # frequencies; a curve has no more features than a packing has modes


@reads_any_file
def gstar(
    files: Annotated[
        list[Path] | None, typer.Argument(help="Files as in `analyze`. Packings of one kind give a mean.")
    ] = None,
    n: Annotated[int | None, typer.Option("--n", "-n", help="Disks to pack (without FILES).")] = None,
    pressure: Annotated[float | None, typer.Option(help="Their pressure (units of k).")] = None,
    seed: Seed = 1,
    ensemble: EnsembleOption = "fixed-box",
    frame: FrameOption = -1,
    beta: Beta = 1.0,
    alpha: Alpha = 1.0,
    tau: Tau = 1.0,
    stokes: Stokes = False,
    eta_f: EtaF = 1.0,
    drag: Drag = None,
    prestress: Annotated[bool, typer.Option(help="Keep the contact forces in the Hessian.")] = True,
    method: Annotated[str, typer.Option(metavar="{auto,dense,direct,reduced}", help="Solver.")] = "auto",
    omega_min: Annotated[float, typer.Option(help="Lowest angular frequency, 1/tau_1.")] = 1e-6,
    omega_max: Annotated[float, typer.Option(help="Highest angular frequency, 1/tau_1.")] = 1e2,
    points: Annotated[int, typer.Option(help="Number of frequencies, evenly spaced in log omega.")] = 41,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Picture (.png, .pdf, .svg) or table (.csv, .tsv) to write.")
    ] = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
    *,
    reading: dict[str, Any],
) -> None:
    """Compute the complex shear modulus G*(omega).

    G*_xy is for shear along x of the box; the static G, averaged over directions, is printed too. Packings that differ
    in more than their random start, such as in pressure, force law, sizes or ensemble, are averaged kind by kind.
    """
    from jamlab.protocols.target_pressure import pack as make
    from jamlab.rheology.mean_spectrum import mean_spectra
    from jamlab.trajectories.files import read

    if not files and (n is None or pressure is None):
        raise InputError("no packing is given: give FILES, or --n and --pressure of a packing to make")
    omega = _frequencies(omega_min, omega_max, points)
    if out is not None:
        check_output(out, replace=overwrite)
        expect_output(out)
    law = drag_law(drag, stokes, beta, alpha, tau, eta_f)
    packings = (
        [read(file, frame, **reading) for file in files]
        if files
        else [make(int(n or 0), float(pressure or 0), seed, ensemble=ensemble)]
    )
    found = mean_spectra(packings, omega, law, prestress=prestress, method=method)
    if out is not None:
        save(found, out)
    if as_json:
        curves = [_summary(spectrum) for spectrum in found]
        print_json(curves[0] if len(curves) == 1 else {"curves": curves})
        return
    print_spectra(found)
    if out is not None:
        print_line(f"wrote {out}")


def _frequencies(lowest: float, highest: float, points: int) -> "Array":
    import numpy as np

    if not 0 < lowest < highest < np.inf or not 2 <= points <= MOST_POINTS:
        raise InputError(f"{points} points from {lowest} to {highest}: need 0 < min < max, 2 to {MOST_POINTS} points")
    return np.geomspace(lowest, highest, points)


def _summary(spectrum: "MeanSpectrum") -> dict[str, Any]:
    """Plain numbers: limits and mean curves, of each packing too if there are several."""
    from jamlab.rheology.mean_spectrum import LIMITS

    each = spectrum.packings
    content: dict[str, Any] = {"kind": spectrum.kind, "units": spectrum.units}
    content |= {"converged": bool(each["converged"].all()), "method": spectrum.method}
    content |= {"shear": SHEAR, "omega": spectrum.omega.tolist()}
    content |= {name: float(each[name].mean()) for name in ("g", *LIMITS)}
    content |= {name: getattr(spectrum, name).tolist() for name in _CURVES}
    if len(each) > 1:
        numbers = each[["packing", "g", *LIMITS]].to_dict("records")
        curves = [{name: getattr(own, name).tolist() for name in _CURVES} for own in spectrum.spectra]
        content["packings"] = [row | own for row, own in zip(numbers, curves, strict=True)]
    return content


def print_spectra(spectra: "MeanSpectra") -> None:
    """Print G*_xy(omega) of each kind, below it its limits and the static G averaged over directions."""
    for spectrum in spectra:
        each, table = spectrum.packings, spectrum.to_dataframe().dropna(axis="columns", how="all")
        count, bad = len(each), int((~each["converged"]).sum())
        kind = f"{spectrum.kind}; " * (len(spectra) > 1)
        title = f"{spectra.damping}; {kind}{count} packing{'s' * (count > 1)}, {spectrum.method}"
        lines = [[f"{value:.4g}" for value in row] for row in table.to_numpy()]
        print_table(title + f", {bad} NOT CONVERGED" * bool(bad), [_HEADINGS[str(name)] for name in table], lines)
        mean = each[["g0", "g", "eta0", "eta_inf"]].mean()
        over = f"; G = {mean['g']:.5g}: static, mean over directions" if mean["g"] == mean["g"] else ""  # none: walls
        print_note(f"G_xy = {mean['g0']:.5g}: static, for shear along x of the box, as G*{over}")
        print_note(f"eta0 = {mean['eta0']:.5g}, eta_inf = {mean['eta_inf']:.5g}")


def check_output(path: Path, *, replace: bool = True) -> None:
    """Check that a path has a known suffix and can be written; an existing file only with `replace`."""
    check_ending(path, "picture", "table", "tabs")
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
