"""`jamlab doctor`: check the installation."""

import typer
from rich.text import Text

from jamlab.cli.console import out_console, print_json
from jamlab.cli.options import Json


def doctor(as_json: Json = False) -> None:
    """Check the installation, and say how to repair it."""
    from jamlab.engine.installation import examine

    findings = examine()
    if as_json:
        print_json({f.subject: {"ok": f.right, "detail": f.detail} for f in findings})
    else:
        for f in findings:
            mark = Text("ok  ", style="green") if f.right else Text("FAIL", style="red")
            out_console.print(mark, f"{f.subject:12s} {f.detail}", soft_wrap=True)
    if not all(f.right for f in findings):
        raise typer.Exit(1)
