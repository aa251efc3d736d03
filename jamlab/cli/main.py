"""The command `jamlab`: all commands, and one line for every error a user can cause."""

import logging
import sys
from collections.abc import Sequence
from typing import Annotated, Any

import typer
from rich.text import Text
from typer.core import TyperCommand, TyperGroup
from typer.exceptions import TyperException

from jamlab.cli import campaign
from jamlab.cli.analyze import analyze, explore
from jamlab.cli.console import err_console, warnings_as_lines
from jamlab.cli.decks import deck, decks, doctor
from jamlab.cli.flow import creep, flow_curve, oscillate, relax_stress, shear
from jamlab.cli.gstar import gstar
from jamlab.cli.interruption import interrupt_on_signals, last_line, stopping_signal
from jamlab.cli.jam import compress, convert, demo, jam, pack, relax
from jamlab.errors import JamlabError
from jamlab.old_names import MEANT


class Hinting(TyperGroup):
    """Commands of which one typed from habit is told which to use."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Find a command."""
        try:
            return super().resolve_command(ctx, args)
        except TyperException as error:
            from jamlab.checks import name_meant

            known, use = self.list_commands(ctx), _OTHERS.get(args[0])
            said = f"use `jamlab {use}`" if use else name_meant(args[0], known, f"use one of {', '.join(known)}")
            error.message = f"No such command {args[0]!r}: {said}"
            raise


class Commands(Hinting):
    """All commands: print one line for every error a user can cause; `--debug` shows the traceback, and the log."""

    debug = False

    def main(self, args: Sequence[str] | None = None, *rest: Any, **options: Any) -> Any:
        """Take `--debug` out of the words, wherever it stands, and run the command; `help X` is `X --help`."""
        words = list(sys.argv[1:] if args is None else args)
        if words[:1] in (["help"], ["version"]):
            words = [*words[1:], f"--{words[0]}"]
        self.debug = "--debug" in words
        if self.debug:
            logging.basicConfig()
            logging.getLogger("jamlab").setLevel(logging.DEBUG)
        return super().main([word for word in words if word != "--debug"], *rest, **options)

    def invoke(self, ctx: Any) -> Any:
        """Run the command; exit with 1 after an error."""
        try:
            return super().invoke(ctx)
        except (TyperException, typer.Exit, typer.Abort):  # usage, and the end that a command asked for
            raise
        except (Exception, KeyboardInterrupt) as error:
            if (number := stopping_signal()) is not None:
                err_console.print(last_line(), soft_wrap=True, highlight=False)
                raise typer.Exit(128 + number) from None
            if self.debug:
                raise
            err_console.print(Text("error:", style="red"), _line(error), soft_wrap=True, highlight=False)
            raise typer.Exit(1) from None


def _line(error: BaseException) -> str:
    if isinstance(error, JamlabError):
        return " ".join(str(error).split())
    if isinstance(error, BrokenPipeError):
        return "broken pipe: the program that reads the output has ended"
    if isinstance(error, OSError):
        return f"{error.filename or 'the system'}: {error.strerror or error}"
    if isinstance(error, MemoryError):
        return "not enough memory: choose fewer particles or points"
    return f"internal error, please report it with the output of --debug: {type(error).__name__}: {error}"


_OF_TOPICS = {
    "Force law and sizes": "law ratio large sizes",
    "Drag law": "beta alpha tau stokes eta_f background",
    "Accuracy and cores": "tolerance ranks processes workers",
    "Output": "out plot csv overlay packing force as_json",
}
TOPICS = {name: topic for topic, names in _OF_TOPICS.items() for name in names.split()}


class OwnCommand(TyperCommand):
    """A command whose help lists its options by topic, and that says what to use for options typed from habit."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the words of the command."""
        given = list(args)
        try:
            return super().parse_args(ctx, args)
        except TyperException as error:
            if type(error) is typer.BadParameter and not any(word in error.message for word in given):
                error.message += f", in {' '.join(given)}"
            name = str(getattr(error, "option_name", "")).lstrip("-").replace("-", "_")
            if name in MEANT:
                error.message += f"; use {MEANT[name]}"
            elif not isinstance(error, typer.BadParameter) and name not in {each.name for each in self.params}:
                error.message += f"; it takes {', '.join(each.opts[0] for each in self.params)}"
            raise

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write each topic below its heading."""
        topics: dict[str, list[tuple[str, str]]] = {}
        for each in self.get_params(ctx):
            if line := each.get_help_record(ctx):
                plain = "Arguments" if each.param_type_name == "argument" else "Options"
                topics.setdefault(TOPICS.get(each.name or "", plain), []).append(line)
        for topic, lines in topics.items():
            with formatter.section(topic):
                formatter.write_dl(lines)


_OTHERS = {
    "minimize": "relax",
    "decompress": "compress",
    **dict.fromkeys(("measure", "info", "analyse"), "analyze"),
    "export": "convert",
    **dict.fromkeys(("view", "plot", "movie"), "explore"),
    **dict.fromkeys(("run", "lmp"), "deck"),
    **dict.fromkeys(("check", "test"), "doctor"),
    "list": "decks",
    "init": "campaign new",
}


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
    help="Jammed packings of soft disks and deformable droplets in two dimensions.",
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
        relax: "disks.csv --out relaxed.h5",
    },
    "Measure and look": {
        analyze: "photo.png --pixel 0.65 --overlay out.png --csv droplets.csv",
        gstar: "--n 256 --pressure 1e-3 --out gstar.png",
        explore: "sweep.h5 --out page.html",
        convert: "sweep.h5 sweep.dump",
    },
    "Flow": {
        shear: "packing.h5 --rate 1e-2 --strain 2 --plot shear.png",
        flow_curve: "packing.h5 --rate 1e-3 --rate 1e-2 --rate 0.1",
        oscillate: "packing.h5 --omega 0.1 --amplitude 1e-4",
        creep: "packing.h5 --stress 1e-4 --duration 1e4 --plot creep.png",
        relax_stress: "packing.h5 --strain 1e-5 --duration 1e4",
    },
    "Start": {
        demo: "--out jamlab-demo",
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
    interrupt_on_signals()
    app()


if __name__ == "__main__":
    main()
