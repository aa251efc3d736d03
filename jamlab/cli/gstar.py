"""`jamlab gstar`: the complex shear modulus."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from jamlab.cli.console import out_console, print_json, print_note, print_table
from jamlab.cli.interruption import expect_output
from jamlab.cli.options import Alpha, Beta, Ensemble, EtaF, Force, Frame, Json, Seed, Stokes, Tau, drag_law
from jamlab.errors import InputError

if TYPE_CHECKING:
    from jamlab.rheology.mean_spectrum import Spectra

MOST_POINTS = 100_000  # frequencies; a curve has no more features than a packing has modes


def gstar(
    files: Annotated[
        list[Path] | None, typer.Argument(help="HDF5 files; those of packings alike give a mean and a band.")
    ] = None,
    n: Annotated[int | None, typer.Option("--n", help="Without files: number of disks to pack, even.")] = None,
    pressure: Annotated[float | None, typer.Option(help="Without files: pressure to pack them to, k.")] = None,
    seed: Seed = 1,
    ensemble: Ensemble = "fixed-box",
    frame: Frame = -1,
    beta: Beta = 1.0,
    alpha: Alpha = 1.0,
    tau: Tau = 1.0,
    stokes: Stokes = False,
    eta_f: EtaF = 1.0,
    prestress: Annotated[bool, typer.Option(help="Keep the contact forces in the Hessian.")] = True,
    method: Annotated[str, typer.Option(help="auto, dense, direct or reduced.")] = "auto",
    omega_min: Annotated[float, typer.Option(help="Lowest angular frequency, 1/tau_1.")] = 1e-6,
    omega_max: Annotated[float, typer.Option(help="Highest angular frequency, 1/tau_1.")] = 1e2,
    points: Annotated[int, typer.Option(help="Number of frequencies, evenly spaced in log omega.")] = 41,
    out: Annotated[Path | None, typer.Option(help=".png, .pdf, .svg, .csv or .tsv (omega, G', G'') or .h5.")] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Compute the complex shear modulus G*(omega) of disks or droplets, after Baumgarten & Tighe.

    It is G*_xy, for shear along x of the box; the static G averaged over directions is printed beside it. Packings
    that differ in pressure, units, force law, sizes or ensemble get a curve each.
    """
    import numpy as np

    from jamlab.cli import spectrum_output
    from jamlab.packing.hdf5 import read
    from jamlab.protocols.target_pressure import pack as make
    from jamlab.rheology.mean_spectrum import mean_spectra

    if not 0 < omega_min < omega_max < np.inf or not 2 <= points <= MOST_POINTS:
        raise InputError(
            f"frequencies {omega_min} .. {omega_max} in {points} points: need 0 < min < max"
            f" and 2 to {MOST_POINTS} points"
        )
    if bool(files) == (n is not None or pressure is not None) or (n is None) != (pressure is None):
        raise InputError(f"n = {n}, pressure = {pressure}: give files, or --n and --pressure of a packing to make")
    if out is not None:
        spectrum_output.check_output(out, files or [], replace=force)
        expect_output(out)
    law = drag_law(stokes, beta, alpha, tau, eta_f)
    packings = (
        [read(file, frame) for file in files]
        if files
        else [make(int(n or 0), float(pressure or 0), seed, ensemble=ensemble)]
    )
    if out is not None:
        spectrum_output.check_one_kind(out, packings)
    omega = np.geomspace(omega_min, omega_max, points)
    found = mean_spectra(packings, omega, law, prestress=prestress, method=method)
    if out is not None:
        spectrum_output.save(found, law, out)
    if as_json:
        curves = [spectra.summary() for spectra in found]
        print_json(curves[0] if len(curves) == 1 else {"curves": curves})
        return
    for spectra in found:
        print_spectra(f"{law}; {spectra.description}", spectra)
    if out is not None:
        out_console.print(f"wrote {out}", soft_wrap=True)
    if len(found) > 1:
        out_console.print(f"{len(packings)} packings of {len(found)} kinds: a curve each, no mean", soft_wrap=True)


def print_spectra(name: str, spectra: "Spectra") -> None:
    """Print G*_xy(omega), below its limits and the static G averaged over directions."""
    from jamlab.packing.law_parameters import NEGATIVE_G

    names, rows = spectra.rows()
    print_table(name, names, rows)
    print_note(
        f"G_xy = {spectra.limit('g0'):.5g}: static, for shear along x of the box, as G*; "
        f"G = {spectra.mean_g:.5g}: static, mean over directions"
    )
    for name, value in (("G_xy", spectra.limit("g0")), ("G", spectra.mean_g)):
        if value < 0:
            print_note(f"{name} {NEGATIVE_G}")
    print_note(f"eta0 = {spectra.limit('eta0'):.5g}, eta_inf = {spectra.limit('eta_inf'):.5g}")
