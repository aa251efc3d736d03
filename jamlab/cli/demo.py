"""`jamlab demo`: the main job."""

from pathlib import Path
from typing import Annotated

import typer

from jamlab.cli.console import bars, err_console, out_console, print_json, print_spectra, print_table
from jamlab.cli.options import Json, N, Seed


def demo(
    n: N = 64,
    seed: Seed = 1,
    to: Annotated[float, typer.Option(help="Last true packing fraction.")] = 0.95,
    out: Annotated[Path, typer.Option(help="Folder for HDF5, PNG and HTML.")] = Path("jamlab-demo"),
    as_json: Json = False,
) -> None:
    """Both models from a random start through jamming to rho = 0.95: tables, pictures, one HTML page."""
    from jamlab.cli.demo_run import HEADINGS, rows, run_demo, unconverged
    from jamlab.figures.packing_pictures import MODEL_STYLE

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
