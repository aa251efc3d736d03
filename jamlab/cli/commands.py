"""How commands read their words, print one line for every error a user can cause, and lay out their help."""

import logging
import os
import sys
from collections.abc import Collection, Sequence
from contextlib import suppress
from functools import partial
from itertools import takewhile
from pathlib import Path
from typing import Any

import typer
from rich.text import Text
from typer.core import TyperCommand, TyperGroup
from typer.exceptions import TyperException

import jamlab
from jamlab.cli.command_habits import AGAIN
from jamlab.cli.command_habits import COMMANDS as HABITS
from jamlab.cli.console import err_console
from jamlab.cli.given import check_given
from jamlab.cli.interruption import end_on_signals, interrupt_on_signals, last_line, stopping_signal
from jamlab.errors import InputError, JamlabError, naming_options
from jamlab.habits import LIMITS, MODULE, SHELL
from jamlab.hints import meant, misspelt


class Hinting(TyperGroup):
    """A group that answers an unknown command with the command to use."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Find a command."""
        try:
            return super().resolve_command(ctx, args)
        except TyperException as error:
            known, group = self.list_commands(ctx), f"{ctx.info_name} " * (ctx.parent is not None)
            near = misspelt(args[0].replace("-", "_"), [each.replace("-", "_") for each in known]).replace("_", "-")
            use = HABITS.get(args[0], "")
            use = f"{group}{near}" if near else use if use.startswith(group) else ""
            in_python = "" if use or group else _in_python(args[0])
            said = f"use `jamlab {use}`" if use else in_python or f"use one of {', '.join(known)}"
            if not group and args[0] in AGAIN:
                said = "give the command again that was interrupted: it resumes"
            error.message = f"No such command {args[0]!r}: {said}"
            raise


def _in_python(word: str) -> str:
    """What a word means for which there is no command, but a function of Python; "" where nothing is known."""
    name = word.replace("-", "_")
    use = f"`jamlab.{name}`" if name in dir(jamlab) else meant(name, [MODULE], dir(jamlab))
    return use if use == LIMITS else f"there is none; in Python use {use}" if use else ""


class Commands(Hinting):
    """All commands: print one line for every error a user can cause; `--debug` shows the traceback, and the log."""

    debug = False
    ends_with_a_line = False  # on SIGINT and SIGTERM: not where another program calls the commands

    def main(self, args: Sequence[str] | None = None, *rest: Any, **options: Any) -> Any:
        """Take `--debug` out of the words, wherever it stands, and run the command; `help X` is `X --help`."""
        words = list(sys.argv[1:] if args is None else args)
        if words[:1] in (["help"], ["version"]):
            words = [*words[1:], f"--{words[0]}"]
        self.debug = "--debug" in words
        if self.debug:
            logging.basicConfig()
            logging.getLogger("jamlab").setLevel(logging.DEBUG)
        try:
            with naming_options():
                try:
                    return super().main([word for word in words if word != "--debug"], *rest, **options)
                finally:
                    _flush()
        except OSError as error:  # of printing the help
            if self.debug:
                raise
            err_console.print(Text("error:", style="red"), _line(error), soft_wrap=True, highlight=False)
            sys.exit(1)

    def invoke(self, ctx: Any) -> Any:
        """Run the command; exit with 1 after an error."""
        try:
            if self.ends_with_a_line:  # not before or after: nothing would turn the interrupt into a line
                interrupt_on_signals()
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
            with suppress(OSError):  # it may be the error that has just been printed
                _flush()
            raise typer.Exit(1) from None
        finally:
            if self.ends_with_a_line:
                end_on_signals()


def _flush() -> None:
    """Write what is left of the output. What cannot be written goes nowhere then: it would fail again at exit."""
    try:
        sys.stdout.flush()
    except OSError:
        with suppress(OSError):  # a stream without a file
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise


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


def _of_a_law(word: str, options: Collection[str]) -> str:
    """How to give a parameter of a law, or a drag law by its name."""
    from jamlab.packing.kinds import MODELS
    from jamlab.protocols.makings import making_of
    from jamlab.rheology.drag_law import DRAGS

    if "--damping" in options and word in DRAGS.names():
        return f"--damping {word}"
    if "--damping" in options and any(word in law.parameters() for law in DRAGS.each().values()):
        return f"--damping {word}=VALUE"
    parameters = {name for model in MODELS.names() for name in making_of(model).arguments({})}
    return f"--law {word}=VALUE" if "--law" in options and word in parameters else ""


_FOREIGN = "Files of other programs"
TOPICS = {
    name: topic
    for topic, names in {
        "Force law and sizes": "law sizes size_ratio fraction_large",
        "Drag law": "damping background_drag",
        "Accuracy and cores": "force_tolerance pressure_tolerance tolerance trajectory_error ranks workers",
        _FOREIGN: "units box radii atom_style",
        "Output": "out plot csv overlay overwrite json",
    }.items()
    for name in names.split()
}


_ORDER = ["Arguments", "Options", *dict.fromkeys(TOPICS.values())]


class Once(TyperCommand):
    """A command that refuses an option given again, of which one value would be ignored, and several values behind an
    option that is repeated for each."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the words of the command."""
        _, beyond, order = self.make_parser(ctx).parse_args(args=list(args))
        for k, each in enumerate(order):
            if each in order[:k] and not each.multiple and not getattr(each, "is_flag", False):
                raise InputError(f"{each.opts[0]} is given twice: give one value")
        if not ctx.allow_extra_args:
            self._check_repeated(args, bool(beyond))
        return super().parse_args(ctx, args)

    def _check_repeated(self, args: list[str], beyond: bool) -> None:
        """Refuse several values behind an option that takes one each time. `beyond`: words are left over that nobody
        takes; else a command of several files takes them, of which none is called NAME=VALUE."""
        several = {opt for each in self.params if getattr(each, "multiple", False) for opt in each.opts}
        for k, word in enumerate(args):
            flag, equals, value = word.partition("=")
            if flag in several:
                first, *rest = [value, *args[k + 1 :]] if equals else args[k + 1 :]
                values = [first, *takewhile(partial(_like, first), rest)]
                if len(values) > 1 and (beyond or "=" in values[1]):
                    again = " ".join(f"{flag} {each}" for each in values)
                    raise InputError(f"{flag} takes one value and is given again for each: {again}")


def _like(value: str, word: str) -> bool:
    """Whether a word may be a further value of an option: a number as the first one, or no number, option or file."""
    if _is_number(value):
        return _is_number(word)
    return not (_is_number(word) or word.startswith("-") or Path(word).exists())


def _is_number(word: str) -> bool:
    with suppress(ValueError):
        float(word)
        return True
    return False


class OwnCommand(Once):
    """A command whose help lists its options by topic, and that says what to use for options typed from habit."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the words of the command."""
        given = list(args)
        try:
            return super().parse_args(ctx, args)
        except TyperException as error:
            if type(error) is typer.BadParameter and not any(word in error.message for word in given):
                error.message += f", in {' '.join(given)}"
            if (name := getattr(error, "option_name", None)) and hasattr(error, "possibilities"):
                error.possibilities = None  # names that look alike, whatever they mean
                error.message += f"; {self._option_meant(name)}"
            raise

    def _option_meant(self, name: str) -> str:
        """What to use instead of an option that the command does not have."""
        options = {
            opt.lstrip("-").replace("-", "_"): opt
            for each in self.params
            for opt in sorted(each.opts, key=len)
            if opt.startswith("-")
        }
        word = name.lstrip("-").replace("-", "_")
        several = {str(each.name): each.opts[0] for each in self.params if getattr(each, "multiple", False)}
        if word in several:  # its name in Python, where all values are given at once
            return f"use {several[word]}"
        if use := _of_a_law(word, options.values()):
            return f"use {use}"
        use = meant(word, [f"jamlab {self.name}", SHELL], options, argument=True)
        use = options.get(use.strip("`"), use) or options.get(misspelt(word, options), "")
        return use if use == LIMITS else f"use {use}" if use else f"it takes {', '.join(options.values())}"

    def invoke(self, ctx: Any) -> Any:
        """Run the command, unless it would ignore what was given, or write over what it reads."""
        given = {
            each.name: each.opts[0] if each.opts[0].startswith("-") else each.name.upper()
            for each in self.params
            if each.name and getattr(ctx.get_parameter_source(each.name), "name", "") == "COMMANDLINE"
        }
        check_given(str(self.name), ctx.params, given)
        opts = [each.opts[0] for each in self.params if each.opts[0].startswith("--")]
        with naming_options({opt.removeprefix("--").replace("-", "_"): opt for opt in opts}):
            return super().invoke(ctx)

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write each topic below its heading."""
        topics: dict[str, list[tuple[str, str]]] = {}
        names = {each.name for each in self.params}
        foreign = {"law", "model"} if "radii" in names and "sizes" not in names else set()
        for each in self.get_params(ctx):
            if line := each.get_help_record(ctx):
                word = each.param_type_name == "argument"
                line = (str(each.metavar), line[1]) if word else line
                plain = "Arguments" if word else "Options"
                topic = _FOREIGN if each.name in foreign else TOPICS.get(each.name or "", plain)
                topics.setdefault(topic, []).append(line)
        for topic, lines in sorted(topics.items(), key=lambda named: _ORDER.index(named[0])):
            with formatter.section(topic):
                formatter.write_dl(lines)
