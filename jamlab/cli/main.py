"""The command `jamlab`: its commands, in groups."""

from typing import Annotated, Any

import typer

from jamlab.cli import campaign
from jamlab.cli.analyze import analyze, explore
from jamlab.cli.anneal import anneal, relax_radii, swap_sizes
from jamlab.cli.commands import Commands, Hinting, OwnCommand
from jamlab.cli.console import warnings_as_lines
from jamlab.cli.decks import deck, decks, doctor
from jamlab.cli.estimate import estimate
from jamlab.cli.flow import creep, flow_curve, oscillate, quasistatic_shear, relax_stress, shear, stop_flow
from jamlab.cli.gstar import gstar
from jamlab.cli.jam import compress, convert, decompress, demo, droplets, jam, pack, relax


class OwnCommands(Commands):
    """The commands of `jamlab`, in groups."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the commands below the headings of their groups."""
        for heading in dict.fromkeys(_HEADINGS.values()):
            with formatter.section(heading):
                found = [name for name in self.list_commands(ctx) if _HEADINGS[name] == heading]
                formatter.write_dl([(name, self.commands[name].get_short_help_str(62)) for name in found])


app = typer.Typer(
    cls=OwnCommands,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Jammed packings of soft disks and deformable droplets in two dimensions, on LAMMPS.",
    epilog="Start with: jamlab demo",
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        typer.echo(f"jamlab {version('jamlab')}")
        raise typer.Exit


@app.callback()
def options(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", "-V", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Take the options that stand before a command."""
    context.with_resource(warnings_as_lines())


COMMANDS: dict[str, dict[Any, str]] = {  # of each group: the function, and an example of its words
    "Make packings": {
        jam: "--model dp --n 16 --seed 3 --out onset.h5",
        pack: "--n 256 --pressure 1e-4 --out packing.h5",
        compress: "onset.h5 --to 0.95 --step 0.005 --out sweep.h5",
        decompress: "packing.h5 --pressure 1e-5 --out loose.h5",
        droplets: "outlines.csv --box 40,30 --vertices 16 --out droplets.h5",
        relax: "disks.csv --box 12.5,12.5 --units k --out relaxed.h5",
        swap_sizes: "packing.h5 --sweeps 10000 --pressure 1e-3 --out stable.h5",
        relax_radii: "packing.h5 --out stable.h5",
        anneal: "packing.h5 --temperature 1e-2 --temperature 1e-6 --out annealed.h5",
    },
    "Measure and look": {
        analyze: "photo.png --pixel 0.65 --overlay out.png --csv droplets.csv",
        estimate: "z --rho 0.9 --error 0.1 --dry-run",
        gstar: "--n 256 --pressure 1e-3 --out gstar.png",
        explore: "sweep.h5 --out page.html",
        convert: "sweep.h5 sweep.dump",
    },
    "Flow": {
        shear: "packing.h5 --rate 1e-2 --strain 2 --plot shear.png",
        quasistatic_shear: "packing.h5 --strain 0.1 --plot shear.png",
        flow_curve: "packing.h5 --rate 1e-3 --rate 1e-2 --rate 0.1",
        oscillate: "packing.h5 --omega 0.1 --amplitude 1e-4",
        creep: "packing.h5 --stress 1e-4 --duration 1e4 --plot creep.png",
        relax_stress: "packing.h5 --strain 1e-5 --duration 1e4",
        stop_flow: "shear.h5 --duration 1e3",
    },
    "Start": {
        demo: "--folder jamlab-demo",
        decks: "--copy my-decks",
        deck: "in.sp.jam --n 64 --to 0.9",
        doctor: "",
    },
}
_HEADINGS = {}
for heading, group in COMMANDS.items():
    for command, words in group.items():
        name = command.__name__.replace("_", "-")
        _HEADINGS[name] = heading
        free: dict[str, Any] = {}
        if command is deck:  # its options are variables of the deck; --help after a name is about that deck
            free = {"allow_extra_args": True, "ignore_unknown_options": True, "help_option_names": []}
        example = f"Example: jamlab {name} {words}".rstrip()
        app.command(name, cls=OwnCommand, epilog=example, context_settings=free)(command)
_HEADINGS["campaign"] = "Ensembles"
app.add_typer(campaign.app, name="campaign", cls=Hinting, short_help="Run ensembles of packings from one file.")


def main() -> None:
    """Run the words of the shell."""
    command: Any = typer.main.get_command(app)
    command.ends_with_a_line = True
    command()


if __name__ == "__main__":
    main()
