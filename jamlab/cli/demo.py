"""`jamlab demo`: both models through jamming, as one HTML page."""

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.text import Text

from jamlab.cli.console import (
    err_console,
    out_console,
    print_json,
    print_not_stable,
    print_note,
    print_table,
    progress_bars,
)
from jamlab.cli.gstar import print_spectra
from jamlab.cli.interruption import expect_output
from jamlab.cli.options import Force, Json, N, Seed


def demo(
    n: N = 64,
    seed: Seed = 1,
    to: Annotated[float, typer.Option(help="Last true packing fraction.")] = 0.95,
    out: Annotated[Path, typer.Option(help="Folder for HDF5, PNG and HTML.")] = Path("jamlab-demo"),
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Take both models from a random start through jamming to rho = 0.95: tables, pictures, one HTML page."""
    from jamlab.cli.demo_run import G_NOTE, HEADINGS, run_demo, table_rows, unconverged, unstable
    from jamlab.plotting.palette import MODEL_STYLE

    expect_output(out)
    with progress_bars({"sp": "soft particles", "dp": "deformable polygons"}) as progress:
        sweeps, spectrum = run_demo(n, seed, to, out, progress, force=force)
    if as_json:
        tables: dict[str, Any] = {m: {k: v.tolist() for k, v in sweep.measured.items()} for m, sweep in sweeps.items()}
        onset = {m: sweep.packings[0].onset for m, sweep in sweeps.items()}
        print_json({"out": str(out), "onset": onset, "not_converged": unconverged(sweeps), **tables})
    else:
        for model, sweep in sweeps.items():
            label, onset_rho = MODEL_STYLE[model]["label"], sweep.packings[0].onset
            title = f"{label}: onset at ρ_J = {onset_rho:.5f}, {sweep.seconds:.0f} s"
            print_table(title, HEADINGS, table_rows(sweep))
            print_not_stable(unstable(sweep))
        print_note(G_NOTE)
        if spectrum is not None:
            print_spectra("G*_xy(omega) of the densest SP packing, contact damping, β = 1", spectrum, every=5)
        out_console.print(Text(f"Open {out / 'index.html'}"), soft_wrap=True)
    if spectrum is None:
        err_console.print("G*(omega) left out: the densest SP packing is not stable", soft_wrap=True)
    for line in unconverged(sweeps):
        err_console.print(f"not converged: {line}", soft_wrap=True)
