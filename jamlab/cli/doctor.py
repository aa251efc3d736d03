"""`jamlab doctor` and `jamlab decks`: check the installation, list the LAMMPS decks or copy them."""

from pathlib import Path
from typing import Annotated

import typer
from rich.text import Text

from jamlab.cli.console import out_console, print_json
from jamlab.cli.options import Json


def doctor(as_json: Json = False) -> None:
    """Check what is installed and whether the plugin and MPI work, and say how to repair what does not."""
    from jamlab.engine.doctor import examine

    findings = examine()
    if as_json:
        print_json({f.subject: {"ok": f.right, "detail": f.detail} for f in findings})
    else:
        for f in findings:
            mark = Text("ok  ", style="green") if f.right else Text("FAIL", style="red")
            out_console.print(mark, f"{f.subject:12s} {f.detail}", soft_wrap=True)
    if not all(f.right for f in findings):
        raise typer.Exit(1)


def decks(
    copy: Annotated[Path | None, typer.Option(help="Folder to copy every deck and its parts to.")] = None,
    as_json: Json = False,
) -> None:
    """List the LAMMPS decks with what each does and where it is, or copy them to change them."""
    from jamlab.engine.deck_defaults import copy_decks, summaries
    from jamlab.kernels.installed_files import installed

    folder = installed("lammps_inputs") if copy is None else copy_decks(copy)
    found, examples = summaries(folder), summaries(folder / "examples")
    if as_json:
        print_json({"folder": str(folder), "decks": found, "examples": examples})
        return
    for name, summary in found.items():
        out_console.print(f"{name:16s} {summary}", soft_wrap=True, highlight=False)
    out_console.print("\nRun one in a copy of their folder: lmp -in NAME", soft_wrap=True, highlight=False)
    out_console.print(f"From elsewhere: lmp -in {folder}/NAME -var dir {folder}", soft_wrap=True, highlight=False)
    out_console.print("\nShort decks to start from; run them in their folder, or in that of a copy:")
    for name, summary in examples.items():
        out_console.print(f"{name:24s} {summary}", soft_wrap=True, highlight=False)
    out_console.print(f"They are in {folder / 'examples'}", soft_wrap=True, highlight=False)
