"""`jamlab calibrate`: fit the force law of droplets to published tables."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from jamlab.cli.console import err_console, print_json, print_table
from jamlab.cli.interruption import expect_output
from jamlab.cli.options import Json

if TYPE_CHECKING:
    from jamlab.campaign.driver import Outcome


def calibrate(
    out: Annotated[Path, typer.Option(help="Folder of the scan; run again to go on.")] = Path("calibration"),
    n: Annotated[int, typer.Option("--n", help="Number of droplets, even.")] = 32,
    seeds: Annotated[int, typer.Option(help="Number of packings for each set of parameters.")] = 8,
    workers: Annotated[int | None, typer.Option(help="Number of processes; default: all cores.")] = None,
    as_json: Json = False,
) -> None:
    """Fit gamma, ka and delta of droplets to tables 1 and 2 of Boromand et al., and show how much each matters."""
    from jamlab.studies.droplet_calibration import TARGETS
    from jamlab.studies.droplet_calibration import calibrate as run

    def show(outcome: "Outcome") -> None:
        err_console.print(f"{outcome.state} {outcome.line}, {outcome.seconds:.0f} s", soft_wrap=True, highlight=False)

    expect_output(out)
    changes, found = run(out, n, seeds, workers=workers, progress=show)
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
