"""Command line: parse, call one function, print. Results go to stdout, progress and errors to stderr."""

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from jamlab.atomic_file import check_target
from jamlab.errors import InputError, JamlabError

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Jammed 2D packings, from disks to deformable droplets, from onset to viscoelastic spectrum.",
    epilog="Start with: jamlab demo",
)
# a file or a pipe has no width of its own; tables must not be cut there
out_console = Console(width=None if sys.stdout.isatty() else 140)
err_console = Console(stderr=True)

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object instead of a table.")]
N = Annotated[int, typer.Option("--n", help="Number of particles, even.")]
Seed = Annotated[int, typer.Option(help="Seed of the random start.")]
Out = Annotated[Path, typer.Option(help="HDF5 file to write.")]
File = Annotated[Path, typer.Argument(help="HDF5 file written by jamlab.")]
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

    with _bars({"sp": "soft particles", "dp": "deformable polygons"}, to) as tell:
        runs, spectrum = run_demo(n, seed, to, out, tell)
    if as_json:
        tables = {m: {k: v.tolist() for k, v in run.measured.items()} for m, run in runs.items()}
        onset = {m: r.packings[0].onset for m, r in runs.items()}
        _print_json({"out": str(out), "onset": onset, "not_converged": unconverged(runs), **tables})
    else:
        for model, run in runs.items():
            title = f"{MODEL_STYLE[model]['label']}: onset at rho_J = {run.packings[0].onset:.5f}, {run.seconds:.0f} s"
            _print_table(title, HEADINGS, rows(run))
        if spectrum is not None:
            _print_spectrum("G*(omega) of the densest SP packing", spectrum, every=5)
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
    contact: Annotated[str | None, typer.Option(help="DP contact form: outline or segment.")] = None,
    out: Out = Path("onset.h5"),
    as_json: Json = False,
) -> None:
    """A packing at jamming onset, Boromand et al. 2.3."""
    from jamlab.onset import jam as run

    check_target(out)
    with _bars({model: "to onset"}, 0.84) as tell:
        choice: dict[str, Any] = {} if contact is None else {"contact": contact}
        packing = run(model, n, seed, progress=lambda *a: tell(model, *a), **choice)
    _report([packing], out, as_json)


@app.command(epilog="Example: jamlab pack --n 256 --pressure 1e-4 --out packing.h5")
def pack(
    pressure: Annotated[float, typer.Option(help="Target pressure, k.")],
    n: N = 256,
    seed: Seed = 1,
    out: Out = Path("packing.h5"),
    as_json: Json = False,
) -> None:
    """An SP packing at a target pressure, law and units of Baumgarten & Tighe."""
    from jamlab.pressure import pack as run

    check_target(out)
    with _bars({"sp": "to pressure"}, 1.0) as tell:
        packing = run(n, pressure, seed, progress=lambda *a: tell("sp", *a))
    _report([packing], out, as_json)


@app.command(epilog="Example: jamlab compress onset.h5 --to 0.95 --step 0.005 --out sweep.h5")
def compress(
    file: File,
    to: Annotated[float, typer.Option(help="Last packing fraction.")],
    step: Annotated[float, typer.Option(help="Distance of two states.")] = 0.01,
    by: Annotated[str, typer.Option(help="rho (true) or phi (nominal packing fraction).")] = "rho",
    frame: Frame = -1,
    out: Out = Path("sweep.h5"),
    as_json: Json = False,
) -> None:
    """Compress or decompress a packing in steps; the first frame written is the start."""
    from jamlab.compression import compress as run
    from jamlab.storage import read

    check_target(out)
    start = read(file, frame)
    with _bars({start.model: "compress"}, to) as tell:
        packings = [start, *run(start, to, step, by=by, progress=lambda *a: tell(start.model, *a))]
    _report(packings, out, as_json)


@app.command(epilog="Example: jamlab analyze sweep.h5 --json")
def analyze(file: File, as_json: Json = False) -> None:
    """Measure every packing of a file: rho, z, pressure, G, shape factor."""
    from jamlab.storage import read_all

    _report(read_all(file), None, as_json)


@app.command(epilog="Example: jamlab gstar packing.h5 --beta 1")
def gstar(
    file: File,
    frame: Frame = -1,
    beta: Annotated[float, typer.Option(help="Contact damping: sliding over approach.")] = 1.0,
    stokes: Annotated[bool, typer.Option("--stokes", help="Stokes drag instead of contact damping.")] = False,
    eta_f: Annotated[float, typer.Option(help="Fluid viscosity of Stokes drag, k tau_1.")] = 1.0,
    prestress: Annotated[bool, typer.Option(help="Keep the contact forces in the Hessian.")] = True,
    omega_min: Annotated[float, typer.Option(help="Lowest angular frequency, 1/tau_1.")] = 1e-6,
    omega_max: Annotated[float, typer.Option(help="Highest angular frequency, 1/tau_1.")] = 1e2,
    points: Annotated[int, typer.Option(help="Frequencies, log-spaced.")] = 41,
    out: Annotated[Path | None, typer.Option(help="PNG to draw.")] = None,
    as_json: Json = False,
) -> None:
    """Complex shear modulus G*(omega) of an SP packing, Baumgarten & Tighe."""
    import numpy as np

    from jamlab import report
    from jamlab.damping import ContactDamping, StokesDrag
    from jamlab.figures import modulus_figure
    from jamlab.rheology import complex_modulus
    from jamlab.storage import read

    if not 0 < omega_min < omega_max or points < 2:
        raise InputError(f"frequencies {omega_min} .. {omega_max} in {points} points: need 0 < min < max and 2 points")
    if out is not None:
        check_target(out)
    packing = read(file, frame)
    law = StokesDrag(eta_f=eta_f) if stokes else ContactDamping(beta=beta)
    s = complex_modulus(packing, np.geomspace(omega_min, omega_max, points), law, prestress)
    if out is not None:
        report.save(modulus_figure({str(law): s}, "k" if packing.units == "k" else r"$\epsilon/\sigma^2$"), out)
    converged = bool(packing.provenance.get("converged", False))
    if as_json:
        limits = {"converged": converged, "g0": s.g0, "eta0": s.eta0, "eta_inf": s.eta_inf, "method": s.method}
        curves = {"omega": s.omega, "storage": s.storage, "loss": s.loss, "error": s.error}
        _print_json(limits | {name: values.tolist() for name, values in curves.items()})
        return
    _print_spectrum(str(law) + ("" if converged else " of a packing that is NOT CONVERGED"), s, every=1)


@app.command(epilog="Example: jamlab doctor")
def doctor(as_json: Json = False) -> None:
    """What is installed, whether the plugin and MPI work, and how to mend what does not."""
    from jamlab.doctor import examine

    findings = examine()
    if as_json:
        _print_json({f.subject: {"ok": f.right, "detail": f.detail} for f in findings})
    else:
        for f in findings:
            mark = "[green]ok  [/]" if f.right else "[red]FAIL[/]"
            out_console.print(f"{mark} {f.subject:12s} {f.detail}", soft_wrap=True)
    if not all(f.right for f in findings):
        raise typer.Exit(1)


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


@contextmanager
def _bars(names: dict[str, str], to: float) -> Iterator[Any]:
    """Progress bars on stderr, one per model, from phi = 0.2 to the last packing fraction."""
    columns = (TextColumn("{task.description:28s}"), BarColumn(), TextColumn("{task.fields[at]}"), TimeElapsedColumn())
    quiet = not err_console.is_terminal
    with Progress(*columns, console=err_console, transient=True, disable=quiet) as progress:
        tasks = {model: progress.add_task(name, total=to - 0.2, at="") for model, name in names.items()}

        def tell(model: str, stage: str, fraction: float) -> None:
            progress.update(tasks[model], completed=fraction - 0.2, at=f"{stage} {fraction:.4f}")

        yield tell


def _report(packings: list[Any], out: Path | None, as_json: bool) -> None:
    """Measure packings, store them if a file is named, and print the table."""
    from jamlab.measure import table
    from jamlab.storage import write

    measured = table(packings)
    if out is not None:
        write(out, packings, measured)
    marks = [bool(p.provenance.get("converged", False) and p.provenance.get("on_target", True)) for p in packings]
    if as_json:
        columns: dict[str, Any] = {name: values.tolist() for name, values in measured.items()}
        _print_json({"out": out and str(out), "onset": packings[-1].onset, "converged": marks, **columns})
        return
    names = list(measured)
    rows = zip(*measured.values(), strict=True)
    lines = [
        [f"{value:.6g}" for value in row] + ["yes" if mark else "NO"] for row, mark in zip(rows, marks, strict=True)
    ]
    _print_table(f"{packings[0].model}, n = {packings[0].n}", [*names, "converged"], lines)
    if out is not None:
        out_console.print(f"wrote {out}", soft_wrap=True)


def _print_spectrum(name: str, s: Any, every: int) -> None:
    title = f"{name}: G0 = {s.g0:.5g}, eta0 = {s.eta0:.5g}, eta_inf = {s.eta_inf:.5g}"
    rows = zip(s.omega, s.storage, s.loss, s.error, strict=True)
    _print_table(title, ["ω τ1", "G'", "G''", "error"], [[f"{value:.4g}" for value in row] for row in [*rows][::every]])


def _print_table(title: str, columns: list[str], lines: list[list[str]]) -> None:
    table = Table(title=title, title_justify="left", min_width=min(len(title), 100), box=SIMPLE_HEAD, padding=(0, 1))
    for name in columns:
        table.add_column(name, justify="right", no_wrap=True)
    for line in lines:
        table.add_row(*line)
    out_console.print(table)


def _print_json(content: dict[str, Any]) -> None:
    # JSON knows no nan: a value that is not there is null
    print(json.dumps(json.loads(json.dumps(content), parse_constant=lambda _: None)))


if __name__ == "__main__":
    main()
