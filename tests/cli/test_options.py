"""Options are the lines of the table of arguments; whatever Python takes, the shell takes too."""

import inspect
import json
import re
from math import inf, radians
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import typer
from commands import call

import jamlab
from jamlab.arguments.argument import REQUIRED, FromDeck, InWords
from jamlab.arguments.table import argument
from jamlab.cli import options
from jamlab.cli.left_out import BY_WORDS, LEFT_OUT
from jamlab.cli.main import app
from jamlab.cli.option_values import read_box, read_damping, read_direction, read_law, read_radii

CLI = Path(options.__file__).parent


def leaves(group, words=""):
    """Commands by their words."""
    for name, each in group.commands.items():
        if hasattr(each, "commands"):
            yield from leaves(each, f"{words}{name} ")
        else:
            yield words + name, each


COMMANDS = dict(leaves(typer.main.get_command(app)))
PYTHON = {name: each.callback.python for name, each in COMMANDS.items() if hasattr(each.callback, "python")}


def of_python(name):
    """A public function or method by its name."""
    thing = jamlab
    for part in name.split("."):
        thing = getattr(thing, part)
    return set(inspect.signature(thing).parameters) - {"self"}


def test_a_parameter_without_a_line_in_the_table_is_no_option():
    def spam(*, n: int, nonsense: int) -> None:
        """Nothing."""

    with pytest.raises(KeyError, match="nonsense"):
        options.command()(spam)


def test_no_command_writes_an_option_itself():
    """But for --version, and the words of `jamlab deck`, whose options are variables of a deck."""
    found = {path.name for path in CLI.glob("*.py") if "typer.Option(" in path.read_text()}
    assert found == {"options.py", "main.py"} and PYTHON.keys() == COMMANDS.keys() - {"deck"}


@pytest.mark.parametrize("name", PYTHON)
def test_every_argument_of_python_is_an_option_or_stands_among_those_left_out(name):
    own = {each.name for each in COMMANDS[name].params}
    missing = {f"{each}.{argument}" for each in PYTHON[name] for argument in of_python(each) - own}
    assert {each for each in missing if each.rpartition(".")[2] not in BY_WORDS} <= LEFT_OUT.keys()


def test_nothing_is_left_out_that_is_an_option_or_no_argument():
    taken = {each: own for own in PYTHON.values() for each in own}
    for each in LEFT_OUT:
        function, _, name = each.rpartition(".")
        users = [command for command, own in PYTHON.items() if function in own]
        assert function in taken and name in of_python(function), each
        assert any(name not in {option.name for option in COMMANDS[user].params} for user in users), each


@pytest.mark.parametrize("name", PYTHON)
def test_help_default_and_names_are_those_of_the_table(name):
    for each in COMMANDS[name].params:
        if each.name == "help":
            continue
        line, places = argument(each.name), (f"jamlab {name}", *PYTHON[name])
        default = line.default_at(*places)
        text = re.sub(r"`(\w+)`", lambda found: argument(found[1]).option, line.text_at(*places))
        assert each.help.startswith(text.rstrip(".")), each.name
        assert each.required == (default is REQUIRED)
        if not isinstance(default, FromDeck | InWords) and default not in (REQUIRED, ()):
            wanted = [*default] if isinstance(default, tuple) else default
            assert (str(each.default) if isinstance(each.default, Path) else each.default) == wanted, each.name
        if each.opts[0].startswith("-"):
            assert each.opts[0] == (f"--{line.each}" if line.each else line.option)


def outside(name):
    """Each option of a command with a number, and a value that is out of its range."""
    for each in COMMANDS[name].params:
        if each.name == "help" or each.is_flag if hasattr(each, "is_flag") else True:
            continue
        least, highest = argument(each.name).limits_at(f"jamlab {name}", *PYTHON[name])
        beyond = None if least is None else 2 * least if least < 0 else least - 1
        whole = argument(each.name).kind == "integer"
        for value in (beyond, None if highest is None else 2 * highest):
            if value is not None:
                yield each.opts[0], f"{value:.0f}" if whole else repr(float(value))


@pytest.mark.parametrize("name", PYTHON)
def test_a_number_out_of_range_is_refused_by_its_option(tmp_path, name):
    for flag, value in outside(name):
        said = call(tmp_path, *name.split(), flag, value).stderr
        assert said.startswith(f"error: {flag} ") and said.count("\n") == 1, said


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("jam --search bisect", "--search bisect: use one of bisection, incremental"),
        ("gstar --method fast", "--method fast: use one of auto, dense, direct, reduced"),
        ("jam --search bisectoin", "--search bisectoin: use bisection"),
        ("campaign export c.toml --format xlsx", "--format xlsx: use one of csv"),
        ("pack --pressure nan", "--pressure nan: must be"),
        ("gstar p.h5 --omega-max inf", f"--omega-max {inf}: must be"),
        ("gstar p.h5 --omega-min 2 --omega-max 1", "--omega-min 2: must be below --omega-max 1"),
        ("shear p.h5 --rate 0", "--rate 0.0: use `jamlab quasistatic-shear`"),
        ("relax-stress p.h5 --strain 0 --duration 1", "--strain 0.0: use `jamlab stop-flow`"),
        ("jam --n 7", "--n 7: half of the particles"),
        ("jam --n 8 --sizes spam:2", "--sizes spam:2: use one of"),
        ("estimate z --error 0.1", "give --rho"),
        ("estimate z --rho 0.2 --error 0.1", "--rho 0.2: must lie between"),
        ("gstar --n 8 --pressure 1e-2 --phi 0.9", "give --pressure or --phi, one of them"),
        ("gstar --n 8 --phi 0.9 --damping beta=-1", "--damping beta=-1.0: must be"),
        ("creep p.h5 --stress 1 --duration 1 --damping spam", "spam"),
        (
            "creep p.h5 --stress 1 --duration 1 --damping stokes --damping contact",
            "--damping contact: a law is named already",
        ),
        ("creep p.h5 --stress 1 --duration 1 --damping beta=", "--damping beta=: give it as NAME=VALUE"),
    ],
)
def test_a_wrong_value_names_its_option(tmp_path, line, said):
    assert call(tmp_path, *line.split()).stderr.startswith(f"error: {said}" if said != "spam" else "error: ")


@pytest.mark.parametrize("name", COMMANDS)
def test_help_fits_a_terminal_of_80_columns(tmp_path, monkeypatch, name):
    monkeypatch.setenv("COLUMNS", "80")
    said = call(tmp_path, *name.split(), "--help").stdout
    assert "Usage:" in said and max(map(len, said.splitlines())) <= 80, said


def test_laws_boxes_and_directions_are_read_as_python_takes_them():
    assert read_law(law=None) is None and read_law(law=["hertz"]) == "hertz"
    assert read_law(law=["exponent=2.5", "k=2"]) == {"exponent": 2.5, "k": 2}
    assert read_law(law=["stickiness=0.1", "sticky"]) == {"law": "sticky", "stickiness": 0.1}
    assert read_damping(damping=None) is None
    assert read_damping(damping=["stokes", "eta_f=0.5"]) == jamlab.StokesDrag(eta_f=0.5)
    assert read_damping(damping=["beta=0", "alpha=0.5"]) == jamlab.ContactDamping(beta=0, alpha=0.5)
    assert read_direction(direction="30deg") == radians(30) and read_direction(direction="0.5") == 0.5
    assert read_direction(direction="pure") == "pure"
    assert read_box(box="9,0,1,8") == [[9, 0], [1, 8]] and read_radii(radii="1=0.5,2=0.7") == {"1": 0.5, "2": 0.7}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("options")
    jamlab.write(folder / "p.h5", jamlab.pack(n=16, pressure=2e-2, seed=2))
    return folder


def test_gstar_is_that_of_python_along_a_direction(folder):
    words = "--direction 30deg --damping stokes --damping eta_f=0.5 --omega-min 0.1 --omega-max 1 --points 2 --json"
    said = json.loads(call(folder, "gstar", "p.h5", *words.split()).stdout)
    packing, drag = jamlab.read(folder / "p.h5"), jamlab.StokesDrag(eta_f=0.5)
    wanted = jamlab.complex_modulus(packing, [0.1, 1.0], drag, direction=radians(30))
    assert said["storage"] == wanted.storage.tolist() and said["loss"] == wanted.loss.tolist()
    assert "in the direction" in said["shear"] and "G = " in call(folder, "gstar", "p.h5", *words.split()[:2]).stdout


def test_packings_have_the_law_and_sizes_that_are_given(folder):
    words = "--n 8 --phi 0.9 --law hertz --sizes uniform:0.1 --force-tolerance 1e-11 --out hertz.h5"
    assert call(folder, "pack", *words.split()).exit_code == 0
    made = jamlab.pack(8, phi=0.9, law="hertz", sizes="uniform:0.1", force_tolerance=1e-11)
    assert jamlab.read(folder / "hertz.h5") == made and made.params["exponent"] == 2.5


def test_decompress_is_that_of_python(folder):
    assert call(folder, "decompress", "p.h5", "--pressure", "1e-2").exit_code == 0
    assert jamlab.read(folder / "decompressed.h5") == jamlab.decompress(jamlab.read(folder / "p.h5"), 1e-2)


def test_a_flow_is_stopped_with_its_own_drag_law(folder):
    words = "--rate 0.1 --strain 0.02 --rows 2 --damping beta=0.5 --out run.h5"
    assert call(folder, "shear", "p.h5", *words.split()).exit_code == 0
    assert call(folder, "stop-flow", "run.h5", "--duration", "1", "--out", "stop.h5").exit_code == 0
    assert jamlab.read_flow(folder / "stop.h5").damping == jamlab.ContactDamping(beta=0.5)


def test_what_is_measured_can_be_chosen(folder):
    words = ("p.h5", "--quantity", "psi_6_global", "--quantity", "z", "--csv", "own.csv")
    said = call(folder, "analyze", *words).stdout
    wanted = jamlab.measure([jamlab.read(folder / "p.h5")], ["psi_6_global", "z"])
    assert [*pd.read_csv(folder / "own.csv")] == ["psi_6_global", "z"] and "G_xy" not in said
    assert np.allclose(pd.read_csv(folder / "own.csv"), np.column_stack([*wanted.values()]))
