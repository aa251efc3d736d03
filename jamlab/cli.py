"""Command line: parse, call one function, print."""

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from jamlab.atomic_file import check_target
from jamlab.calibrate_command import calibrate
from jamlab.campaign import cli as campaign
from jamlab.charts.command import chart
from jamlab.comparison.command import compare
from jamlab.console import bars, err_console, out_console, print_json, print_spectra, print_table, report
from jamlab.errors import InputError, JamlabError
from jamlab.figure_command import figure

PICTURES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp")

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Jammed 2D packings, from disks to deformable droplets, from onset to viscoelastic spectrum.",
    epilog="Start with: jamlab demo",
)
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object instead of a table.")]
N = Annotated[int, typer.Option("--n", help="Number of particles, even.")]
Seed = Annotated[int, typer.Option(help="Seed of the random start.")]
Out = Annotated[Path, typer.Option(help="HDF5 file to write.")]
File = Annotated[Path, typer.Argument(help="HDF5 file written by jamlab.")]
Ensemble = Annotated[str, typer.Option(help="fixed-box, or shear-stabilized: no residual shear stress.")]
Frame = Annotated[int, typer.Option(help="Frame of the file; -1 is the last.")]


@app.command(epilog="Example: jamlab demo --out jamlab-demo")
def demo(
    n: N = 64,
    seed: Seed = 1,
    to: Annotated[float, typer.Option(help="Last true packing fraction.")] = 0.95,
    out: Annotated[Path, typer.Option(help="Folder for HDF5, PNG and HTML.")] = Path("jamlab-demo"),
    as_json: Json = False,
) -> None:
    """Both models from a random start through jamming to rho = 0.95: tables, pictures, one HTML page."""
    from jamlab.demo import HEADINGS, rows, run_demo, unconverged
    from jamlab.figures import MODEL_STYLE

    with bars({"sp": "soft particles", "dp": "deformable polygons"}, to) as tell:
        runs, spectrum = run_demo(n, seed, to, out, tell)
    if as_json:
        tables = {m: {k: v.tolist() for k, v in run.measured.items()} for m, run in runs.items()}
        onset = {m: r.packings[0].onset for m, r in runs.items()}
        print_json({"out": str(out), "onset": onset, "not_converged": unconverged(runs), **tables})
    else:
        for model, run in runs.items():
            title = f"{MODEL_STYLE[model]['label']}: onset at rho_J = {run.packings[0].onset:.5f}, {run.seconds:.0f} s"
            print_table(title, HEADINGS, rows(run))
        if spectrum is not None:
            print_spectra("G*(omega) of the densest SP packing", spectrum, every=5)
        out_console.print(f"Open {out / 'index.html'}", soft_wrap=True)
    if spectrum is None:
        err_console.print("G*(omega) left out: the densest SP packing is not stable", soft_wrap=True)
    for line in unconverged(runs):
        err_console.print(f"not converged: {line}", soft_wrap=True)


@app.command(epilog="Example: jamlab jam --model dp --n 16 --seed 3 --out onset.h5")
def jam(
    model: Annotated[str, typer.Option(help="sp (soft disks) or dp (deformable polygons).")] = "sp",
    n: N = 64,
    seed: Seed = 1,
    contact: Annotated[str | None, typer.Option(help="DP contact form: outline, segment or segment/smooth.")] = None,
    search: Annotated[str, typer.Option(help="bisection, or paper: steps of 1e-4 all the way.")] = "bisection",
    ensemble: Ensemble = "fixed-box",
    out: Out = Path("onset.h5"),
    as_json: Json = False,
) -> None:
    """A packing at jamming onset, Boromand et al. 2.3."""
    from jamlab.onset import jam as run

    check_target(out)
    with bars({model: "to onset"}, 0.84) as tell:
        choice: dict[str, Any] = {} if contact is None else {"contact": contact}
        packing = run(model, n, seed, search=search, ensemble=ensemble, progress=lambda *a: tell(model, *a), **choice)
    report([packing], out, as_json)


@app.command(epilog="Example: jamlab pack --n 256 --pressure 1e-4 --out packing.h5")
def pack(
    pressure: Annotated[float, typer.Option(help="Target pressure, k.")],
    n: N = 256,
    seed: Seed = 1,
    ensemble: Ensemble = "fixed-box",
    ranks: Annotated[int, typer.Option(help="MPI ranks; pays from about 10 000 disks.")] = 1,
    out: Out = Path("packing.h5"),
    as_json: Json = False,
) -> None:
    """An SP packing at a target pressure, law and units of Baumgarten & Tighe."""
    from jamlab.pressure import pack as run

    check_target(out)
    with bars({"sp": "to pressure"}, 1.0) as tell:
        packing = run(n, pressure, seed, ensemble=ensemble, ranks=ranks, progress=lambda *a: tell("sp", *a))
    report([packing], out, as_json)


@app.command(epilog="Example: jamlab compress onset.h5 --to 0.95 --step 0.005 --out sweep.h5")
def compress(
    file: File,
    to: Annotated[float, typer.Option(help="Last packing fraction.")],
    step: Annotated[float, typer.Option(help="Distance of two states.")] = 0.01,
    by: Annotated[str, typer.Option(help="rho (true) or phi (nominal packing fraction).")] = "rho",
    nearest: Annotated[float | None, typer.Option(help="First step; log-spaced from there on.")] = None,
    error: Annotated[float | None, typer.Option(help="Follow the basin to this relative error of pressure.")] = None,
    frame: Frame = -1,
    out: Out = Path("sweep.h5"),
    as_json: Json = False,
) -> None:
    """Compress or decompress a packing in steps; the first frame written is the start."""
    from jamlab.compression import compress as run
    from jamlab.storage import read

    check_target(out)
    start = read(file, frame)
    with bars({start.model: "compress"}, to) as tell:
        sweep = run(start, to, step, by=by, nearest=nearest, error=error, progress=lambda *a: tell(start.model, *a))
        packings = [start, *sweep]
    report(packings, out, as_json)


@app.command(epilog="Example: jamlab analyze sweep.h5 --json")
def analyze(
    file: Annotated[Path, typer.Argument(help="HDF5 file written by jamlab, or a picture of droplets.")],
    pixel: Annotated[float, typer.Option(help="Picture: size of a pixel in the unit of length wanted.")] = 1.0,
    film: Annotated[float, typer.Option(help="Picture: widest gap between droplets in contact, pixels.")] = 2.0,
    dark: Annotated[bool, typer.Option("--dark", help="Picture: droplets are darker than the ground.")] = False,
    as_json: Json = False,
) -> None:
    """Measure every packing of a file: rho, z, pressure, moduli, shape factor; or the droplets of a micrograph."""
    from jamlab.storage import read_all

    if file.suffix.lower() not in PICTURES:
        report(read_all(file), None, as_json)
        return
    from jamlab.micrograph import micrograph

    row = micrograph(file, pixel, film, not dark).measure()
    if as_json:
        print_json({name: [value] for name, value in row.items()})
    else:
        print_table(f"droplets of {file.name}", list(row), [[f"{value:.6g}" for value in row.values()]])


@app.command(epilog="Example: jamlab gstar --n 256 --pressure 1e-3 --out gstar.png")
def gstar(
    files: Annotated[list[Path] | None, typer.Argument(help="HDF5 files; several: mean and band.")] = None,
    n: Annotated[int | None, typer.Option("--n", help="Without files: disks of a packing to make, even.")] = None,
    pressure: Annotated[float | None, typer.Option(help="Without files: its pressure, k.")] = None,
    seed: Seed = 1,
    frame: Frame = -1,
    beta: Annotated[float, typer.Option(help="Contact damping: sliding over approach.")] = 1.0,
    stokes: Annotated[bool, typer.Option("--stokes", help="Stokes drag instead of contact damping.")] = False,
    eta_f: Annotated[float, typer.Option(help="Fluid viscosity of Stokes drag, k tau_1.")] = 1.0,
    prestress: Annotated[bool, typer.Option(help="Keep the contact forces in the Hessian.")] = True,
    method: Annotated[str, typer.Option(help="auto, dense, direct or reduced.")] = "auto",
    omega_min: Annotated[float, typer.Option(help="Lowest angular frequency, 1/tau_1.")] = 1e-6,
    omega_max: Annotated[float, typer.Option(help="Highest angular frequency, 1/tau_1.")] = 1e2,
    points: Annotated[int, typer.Option(help="Frequencies, log-spaced.")] = 41,
    out: Annotated[Path | None, typer.Option(help="Picture (.png) or numbers (.h5) to write.")] = None,
    as_json: Json = False,
) -> None:
    """Complex shear modulus G*(omega), Baumgarten & Tighe, of packings of disks or droplets."""
    import numpy as np

    from jamlab import spectra
    from jamlab.damping import ContactDamping, StokesDrag
    from jamlab.pressure import pack as make
    from jamlab.rheology import complex_modulus
    from jamlab.storage import read

    if not 0 < omega_min < omega_max or points < 2:
        raise InputError(f"frequencies {omega_min} .. {omega_max} in {points} points: need 0 < min < max and 2 points")
    if bool(files) == (n is not None or pressure is not None) or (n is None) != (pressure is None):
        raise InputError(f"n = {n}, pressure = {pressure}: give files, or --n and --pressure of a packing to make")
    if out is not None:
        spectra.check_output(out)
    law = StokesDrag(eta_f=eta_f) if stokes else ContactDamping(beta=beta)
    packings = [read(file, frame) for file in files] if files else [make(int(n or 0), float(pressure or 0), seed)]
    omega = np.geomspace(omega_min, omega_max, points)
    found = spectra.Spectra(
        tuple(complex_modulus(p, omega, law, prestress, method) for p in packings),
        packings[0].units,
        tuple(bool(p.provenance.get("converged", False)) for p in packings),
    )
    if out is not None:
        spectra.save(found, str(law), out)
    if as_json:
        print_json(found.summary())
    else:
        print_spectra(f"{law}, {found.description}", found)


app.command(epilog="Example: jamlab figure boromand-6 --out figures")(figure)
app.command(epilog="Example: jamlab calibrate --out calibration --n 16 --seeds 2")(calibrate)


@app.command(epilog="Example: jamlab doctor")
def doctor(as_json: Json = False) -> None:
    """What is installed, whether the plugin and MPI work, and how to mend what does not."""
    from jamlab.doctor import examine

    findings = examine()
    if as_json:
        print_json({f.subject: {"ok": f.right, "detail": f.detail} for f in findings})
    else:
        for f in findings:
            mark = "[green]ok  [/]" if f.right else "[red]FAIL[/]"
            out_console.print(f"{mark} {f.subject:12s} {f.detail}", soft_wrap=True)
    if not all(f.right for f in findings):
        raise typer.Exit(1)


app.add_typer(campaign.app, name="campaign")
app.add_typer(chart, name="chart")
app.command(epilog="Example: jamlab compare --n 64 --out jamlab-compare")(compare)


def main() -> None:
    """Entry point: one line for every error a user can cause, `--debug` shows where it came from."""
    debug = "--debug" in sys.argv
    arguments = [a for a in sys.argv[1:] if a != "--debug"]
    try:
        app(args=arguments)
    except JamlabError as error:
        if debug:
            raise
        err_console.print(f"[red]error:[/] {error}", soft_wrap=True, highlight=False)
        sys.exit(1)


if __name__ == "__main__":
    main()
