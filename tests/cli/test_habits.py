"""Words typed from habit lead to what exists, by meaning; names that only look alike are no hint."""

import re

import pytest
import typer
from commands import call

import jamlab
from jamlab.cli.habits import COMMANDS, OPTIONS, command_meant, option_meant
from jamlab.cli.main import app

KNOWN = typer.main.get_command(app).commands
OF = {
    name: [opt for each in command.params for opt in each.opts] for name, command in KNOWN.items() if name != "campaign"
}


def test_every_command_that_a_hint_names_exists():
    said = [*COMMANDS.values(), *(use for uses in OPTIONS.values() for use in uses)]
    for words in said:
        for name, *option in re.findall(r"`jamlab ([\w-]+)[^`]*?(--[\w-]+)?`", words):
            assert name in KNOWN and set(filter(None, option)) <= set(OF.get(name, ())), words
        for name in re.findall(r"jamlab\.(\w+)", words):
            assert hasattr(jamlab, name)
    assert not set(COMMANDS) & set(KNOWN)


def test_every_option_that_a_hint_names_is_of_the_command():
    for known in OF.values():
        for name in OPTIONS:
            found = re.findall(r"--[\w-]+", re.sub(r"`[^`]*`", "", option_meant(f"--{name}", known)))
            assert set(found) <= {*known, "--debug"}


@pytest.mark.parametrize(
    ("name", "use"),
    [
        ("track", "track_droplets"),
        ("restart", "interrupted"),
        ("sweep", "compress"),
        ("examples", "decks"),
        ("decompress", "compress"),
        ("analize", "analyze"),
        ("stress", "use one of"),
        ("creeping", "use one of"),
    ],
)
def test_commands(name, use):
    assert use in command_meant(name, list(KNOWN))


@pytest.mark.parametrize(
    ("line", "use"),
    [
        ("analyze p.h5 --show", "use `jamlab explore`"),
        ("jam --phi 0.8", "`jamlab pack --phi`"),
        ("shear p.h5 --shear-rate 1", "use --rate"),
        ("jam --threads 2", "use --ranks"),
        ("flow-curve p.h5 --threads 2", "use --processes"),
        ("gstar p.h5 --freq 2", "use --omega-min"),
        ("jam --tolerence 1e-9", "did you mean --tolerance?"),
        ("jam --colour 2", "it takes --model, "),
    ],
)
def test_options(tmp_path, line, use):
    done = call(tmp_path, *line.split())
    assert done.exit_code == 2 and use in done.stderr and "Possible" not in done.stderr
