"""`jamlab calibrate`: fit the force law of droplets to published tables; short for a study."""

from pathlib import Path
from typing import Annotated

import typer

from jamlab.cli.chart import tell
from jamlab.cli.console import err_console, print_json, print_table
from jamlab.cli.interruption import expect_output
from jamlab.cli.options import Force, Json
from jamlab.storage.atomic_file import atomic_file, check_targets


def calibrate(
    out: Annotated[Path, typer.Option(help="Folder of the scan; run again to go on.")] = Path("calibration"),
    n: Annotated[int, typer.Option("--n", help="Number of droplets, even.")] = 32,
    seeds: Annotated[int, typer.Option(help="Number of packings for each set of parameters.")] = 8,
    workers: Annotated[int | None, typer.Option(help="Number of processes; default: all cores.")] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Fit gamma, ka and delta of droplets to tables 1 and 2 of Boromand et al., and show how much each matters."""
    from jamlab.studies.droplet_calibration import DropletCalibration, targets_as_text

    study = DropletCalibration(n=n, seeds=seeds)
    check_targets(out, ["sensitivity.csv"], replace=force)
    expect_output(out)
    study.run(out, tell, workers=workers)
    changes, found = study.fit(out)
    with atomic_file(out / "sensitivity.csv") as temporary:
        changes.to_csv(temporary, index=False)
    if as_json:
        print_json({"sensitivity": changes.to_dict("records"), **vars(found)})
        return
    table = study.changes_as_text(changes)
    print_table(table.heading, table.columns, table.rows)
    table = targets_as_text(found)
    print_table(study.words(found), table.columns, table.rows)
    for name in found.at_edge:
        err_console.print(f"{name} ended at the edge of the scan: scan again from there", soft_wrap=True)
