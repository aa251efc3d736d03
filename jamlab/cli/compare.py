"""`jamlab compare`: the same packing in other codes."""

from pathlib import Path
from typing import Annotated

import typer

from jamlab.cli.chart import tell
from jamlab.cli.console import out_console, print_json, print_table
from jamlab.cli.interruption import expect_output
from jamlab.cli.options import Force, Json, Seed


def compare(
    n: Annotated[int, typer.Option("--n", help="Number of disks, even.")] = 64,
    seed: Seed = 1,
    phi: Annotated[float, typer.Option(help="Nominal packing fraction, above onset.")] = 0.88,
    recipe: Annotated[str | None, typer.Option(help="Write a recipe instead: hoomd.")] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for CSV and HTML, or for the recipe.")] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Compare energy, minimum, time on one core with jax-md, JaxDEM, OpenMM, ASE, LAMMPS; analysis: freud, matscipy."""
    from jamlab.storage.atomic_file import check_targets, make_folder
    from jamlab.studies.other_codes.compare import jolted_minimum, summary
    from jamlab.studies.other_codes.page import (
        FILES,
        Comparison,
        comparison_tables,
        notes,
        write_comparison,
        write_recipe,
    )

    if recipe is not None:
        folder = out or Path(f"jamlab-{recipe}")
        check_targets(folder, ["packing.npz", f"{recipe}_check.py"], replace=force)
        out_console.print(write_recipe(recipe, folder, jolted_minimum(n, seed, phi)[0]), soft_wrap=True)
        return
    if out is not None:
        make_folder(out)
        check_targets(out, FILES, replace=force)
        expect_output(out)
    rows, analysis = Comparison(sizes=(n,), seed=seed, phi=phi).measure(n, tell)
    if out is not None:
        write_comparison(out, rows, analysis, n, phi)
    if as_json:
        print_json(summary(rows, analysis))
        return
    for table in comparison_tables(rows, analysis, n, phi):
        print_table(table.heading, list(table.columns), [list(row) for row in table.rows])
    for name, note in notes(rows, analysis).items():
        out_console.print(f"{name}: {note}", soft_wrap=True, highlight=False, markup=False)
    if out is not None:
        out_console.print(f"Open {out / 'index.html'}", soft_wrap=True)
