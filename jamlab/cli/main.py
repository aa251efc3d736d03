"""The command `jamlab`: all commands, and one line for every error a user can cause."""

import sys

import typer

from jamlab.cli import campaign
from jamlab.cli.analyze import analyze
from jamlab.cli.calibrate import calibrate
from jamlab.cli.chart import chart
from jamlab.cli.compare import compare
from jamlab.cli.compress import compress
from jamlab.cli.console import err_console
from jamlab.cli.decks import decks
from jamlab.cli.demo import demo
from jamlab.cli.doctor import doctor
from jamlab.cli.figure import figure
from jamlab.cli.gstar import gstar
from jamlab.cli.jam import jam
from jamlab.cli.pack import pack
from jamlab.errors import JamlabError

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Jammed 2D packings, from disks to deformable droplets, from onset to viscoelastic spectrum.",
    epilog="Start with: jamlab demo",
)
app.command(epilog="Example: jamlab demo --out jamlab-demo")(demo)
app.command(epilog="Example: jamlab jam --model dp --n 16 --seed 3 --out onset.h5")(jam)
app.command(epilog="Example: jamlab compress onset.h5 --to 0.95 --step 0.005 --out sweep.h5")(compress)
app.command(epilog="Example: jamlab pack --n 256 --pressure 1e-4 --out packing.h5")(pack)
app.command(epilog="Example: jamlab analyze sweep.h5 --json")(analyze)
app.command(epilog="Example: jamlab gstar --n 256 --pressure 1e-3 --out gstar.png")(gstar)
app.command(epilog="Example: jamlab figure boromand-6 --out figures")(figure)
app.command(epilog="Example: jamlab calibrate --out calibration --n 16 --seeds 2")(calibrate)
app.command(epilog="Example: jamlab decks --copy my-decks")(decks)
app.command(epilog="Example: jamlab doctor")(doctor)
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
