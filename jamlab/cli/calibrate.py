"""`jamlab calibrate`: scan, fit, print."""

from pathlib import Path
from typing import Annotated

import typer

from jamlab.cli.console import err_console, print_json, print_table


def calibrate(
    out: Annotated[Path, typer.Option(help="Folder of the scan; run again to go on.")] = Path("calibration"),
    n: Annotated[int, typer.Option("--n", help="Number of droplets, even.")] = 32,
    seeds: Annotated[int, typer.Option(help="Packings for each set of parameters.")] = 8,
    workers: Annotated[int | None, typer.Option(help="Processes, by default one per core.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object instead of a table.")] = False,
) -> None:
    """Fit gamma, ka and delta of the droplets to tables 1 and 2 of Boromand et al.; how much each of them matters."""
    from jamlab.campaign.droplet_calibration import TARGETS
    from jamlab.campaign.droplet_calibration import calibrate as run

    def tell(state: str, line: str, seconds: float) -> None:
        err_console.print(f"{state} {line}, {seconds:.0f} s", soft_wrap=True, highlight=False)

    changes, found = run(out, n, seeds, workers=workers, tell=tell)
    changes.to_csv(out / "sensitivity.csv", index=False)
    if as_json:
        print_json({"sensitivity": changes.to_dict("records"), **vars(found)})
        return
    columns = ["set", "observable", "mean", "error", "change", "change_error"]
    lines = [
        [row[0], row[1], *(f"{value:.4g}" for value in row[2:])] for row in changes[columns].itertuples(index=False)
    ]
    print_table(f"droplets, n = {n}, {seeds} seeds: each parameter halved and doubled", columns, lines)
    fitted = [
        [name, f"{t.value:.4g}", f"{t.tolerance:.2g}", f"{found.predicted[name]:.4g}", t.source]
        for name, t in TARGETS.items()
    ]
    law = ", ".join(f"{name} = {value:.4g}" for name, value in found.law.items())
    title = f"nearest: {law}; misfit {found.misfit:.2f} tolerances, {found.misfit_at_centre:.2f} with the defaults"
    print_table(title, ["observable", "paper", "tolerance", "fit", "source"], fitted)
    for name in found.at_edge:
        err_console.print(f"{name} ended at the edge of the scan: scan again from there", soft_wrap=True)
