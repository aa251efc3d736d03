"""Of every option of every command: in each way to run it, it is used, or refused. No command writes what it reads."""

import inspect
import os
import re
from ast import literal_eval
from itertools import product

import numpy as np
import pytest
import typer
from commands import call

import jamlab
from jamlab.cli.given import INPUTS, OUTPUTS, USES
from jamlab.cli.main import app
from jamlab.cli.option_values import how_to_read

COMMANDS = typer.main.get_command(app).commands
PLAIN = ("p.h5", "p.xyz --units k")  # ways to read: a file of jamlab, one of another program
WAYS = {  # words of each way to run a command that computes
    "jam": ("--n 8", "--n 8 --model dp", "--n 8 --sizes uniform:0.2"),
    "pack": ("--n 8 --pressure 1e-2", "--n 8 --phi 0.8", "--n 8 --pressure 1e-2 --sizes uniform:0.2"),
    "demo": ("--n 8",),
    "droplets": ("d.csv --box 9,9",),
    "estimate": ("z --rho 0.9 --error 0.1", "rho_J --error 0.1", "z --rho 0.9 --error 0.1 --dry-run"),
    **{name: PLAIN for name in ("relax", "explore")},
    **{name: tuple(f"{file} --out q.h5" for file in PLAIN) for name in ("anneal", "swap-sizes", "relax-radii")},
    "convert": tuple(f"{file} q.dump" for file in PLAIN),
    "compress": tuple(f"{file} --to 0.9" for file in PLAIN),
    "decompress": tuple(f"{file} --pressure 1e-3" for file in PLAIN),
    "analyze": (*PLAIN, "a.png", "a.png --labels b.png", "--labels b.png", "a.png --out d.h5"),
    "gstar": (*PLAIN, "--n 8 --pressure 1e-2", "--n 8 --phi 0.9", "--n 8 --phi 0.9 --sizes uniform:0.2"),
    "shear": ("p.h5 --rate 0.1", "p.xyz --units k --rate 0.1"),
    "quasistatic-shear": ("p.h5 --strain 0.1", "p.xyz --units k --strain 0.1"),
    "flow-curve": ("p.h5 --rate 0.1",),
    "oscillate": ("p.h5 --omega 1 --amplitude 0.1", "p.xyz --units k --omega 1 --amplitude 0.1"),
    "creep": ("p.h5 --stress 1e-4 --duration 1",),
    "relax-stress": ("p.h5 --strain 1e-3 --duration 1",),
    "stop-flow": ("p.h5 --duration 1",),
}
APART = {"decks", "deck", "doctor", "campaign"}  # they run no function of the library, or test what it takes themselves
SAME = {
    "out",
    "plot",
    "csv",
    "overlay",
    "overwrite",
    "json",
    "folder",
}  # of every way: test_outputs.py, test_commands.py
VALUES = {  # of options: another than the default, and than in WAYS
    **{"model": "dp", "n": "10", "seed": "2", "law": "exponent=3", "size_ratio": "1.3", "fraction_large": "0.25"},
    **{"sizes": "uniform:0.1", "search": "incremental", "ensemble": "shear-stabilized", "ranks": "2"},
    **{"start": "direct", "tolerance": "1e-4", "force_tolerance": "1e-11", "pressure": "0.02", "phi": "0.7"},
    **{
        "to": "0.97",
        "step": "0.002",
        "by": "phi",
        "first_step": "1e-4",
        "per_decade": "7",
        "pressure_tolerance": "0.1",
    },
    **{
        "error": "0.2",
        "frame": "0",
        "units": "eps",
        "box": "9,9",
        "radii": "0.5",
        "atom_style": "sphere",
        "every": "2",
    },
    **{"pixel": "2", "film": "3", "contrast": "dark", "channel": "red", "labels": "c.png"},
    **{
        "damping": "beta=3",
        "background_drag": "0.1",
        "prestress": None,
        "quantities": "z",
        "method": "direct",
        "direction": "pure",
    },
    **{"omega_min": "1e-3", "omega_max": "10", "points": "7", "rate": "0.2", "rates": "0.2", "strain": "2"},
    **{"strain_step": "0.01", "walls": "", "rows": "5", "snapshot_every": "0.1", "within": "1e9", "discard": "0.5"},
    **{"workers": "2", "omega": "2", "amplitude": "0.2", "cycles": "3", "points_per_cycle": "64", "duration": "2"},
    **{"step_time": "0.1", "quantity": "g", "rho": "0.88", "dry_run": "", "vertices": "7", "rims": "", "wrapped": ""},
    **{
        "stress": "2e-4",
        "largest_strain": "2",
        "memory": "2",
        "trajectory_error": "",
        "until_jammed": "",
        "event_width": "1e-4",
    },
    **{"temperature": "1e-4", "sweeps": "20", "swap_share": "0.5", "radius_stiffness": "0.1"},
}
LIBRARY = (
    *("estimates.estimate.estimate", "estimates.estimate.estimate_cost"),
    *(
        "protocols.compression.go_on",
        "protocols.relax.relax",
        "trajectories.convert.convert",
        "trajectories.files.read",
    ),
    *(
        "trajectories.files.read_all",
        "protocols.decompression.decompress",
        "figures.explorer.write_page.write_page",
        "rheology.mean_spectrum.mean_spectra",
    ),
    *("protocols.target_pressure.pack", "protocols.onset.jam", "flow.shear.shear", "flow.oscillate.oscillate"),
    *("flow.quasistatic_shear.quasistatic_shear", "flow.flow_curve.flow_curve", "flow.flow_curve.flow_cost"),
    *("flow.flow_curve.require_time", "flow.creep_and_relaxation.creep", "flow.creep_and_relaxation.relax_stress"),
    *("flow.creep_and_relaxation.stop_flow", "micrographs.micrograph.micrograph"),
)
GIVES = {
    "read",
    "read_all",
    "pack",
    "jam",
    "droplets_from_outlines",
    "flow_cost",
    "require_time",
    "micrograph",
    "print_packings",
}  # the command goes on with it


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A packing in a file of jamlab, and in one that does not say its units."""
    folder, packing = tmp_path_factory.mktemp("given"), jamlab.pack(n=8, pressure=2e-2, seed=1)
    jamlab.write(folder / "p.h5", packing)
    jamlab.write(folder / "p.xyz", packing)
    (folder / "d.csv").write_text("droplet,x,y\n1,0,0\n1,1,0\n1,0,1\n")
    return folder


@pytest.fixture
def asked(folder, monkeypatch):
    """Function that runs a line and returns its error, and what it asked of the library, without computing it."""
    packing = jamlab.read(folder / "p.h5")
    log = []

    def record(name):
        def call(*args, **named):
            told = {key: value for key, value in named.items() if key not in ("progress", "path", "save")}
            log.append(repr((name, args, told)))
            if name not in GIVES:
                raise jamlab.ConvergenceError("enough")
            several = {"read_all": [packing], "flow_cost": {"seconds": np.ones(2)}, "micrograph": picture}
            return several.get(name, packing)

        return call

    names = ("packing", "draw", "table")
    picture = type("Picture", (), {name: staticmethod(record(name)) for name in names})
    for name in (
        "jam",
        "pack",
        "droplets_from_outlines",
        "anneal",
        "swap_sizes",
        "relax_radii",
    ):  # first: they are found in their modules when they are asked for
        monkeypatch.setattr(jamlab, name, record(name))
    for path in LIBRARY:
        monkeypatch.setattr(f"jamlab.{path}", record(path.rpartition(".")[2]))
    for module in ("analyze", "jam"):
        monkeypatch.setattr(f"jamlab.cli.{module}.print_packings", record("print_packings"))
    monkeypatch.setattr("jamlab.cli.analyze.print_micrograph", lambda *_: None)

    def run(*words):
        log.clear()
        return call(folder, *words).stderr, list(log)

    return run


def test_every_command_is_tried_in_some_way():
    assert set(COMMANDS) == {*WAYS, *APART}
    assert {each.name for name in WAYS for each in COMMANDS[name].params} <= {
        *VALUES, *SAME, *INPUTS, *OUTPUTS, "help"
    }  # fmt: skip
    for use in USES:
        for name in use.commands.split():
            assert {each.name for each in COMMANDS[name].params} >= set(use.options.split()), use


@pytest.mark.parametrize(("name", "way"), [(name, way) for name, ways in WAYS.items() for way in ways])
def test_an_option_is_used_or_refused(asked, name, way):
    """Each option alone, beside what the way needs: the library is asked for something else, or the line names it."""
    error, before = asked(name, *way.split())
    assert before, error
    for option in COMMANDS[name].params:
        flag = option.opts[0]
        if option.name in SAME or not flag.startswith("--") or flag in way.split() or flag == "--help":
            continue
        value = "sp" if (name, flag) == ("analyze", "--model") else VALUES[option.name]
        words = [option.secondary_opts[0]] if value is None else [flag, *([value] if value else [])]
        said, after = asked(name, *way.split(), *words)
        assert after != before or flag in said or option.name in said, (flag, said)
        assert not after or "is used only" not in said


@pytest.mark.parametrize(
    ("line", "flag"),
    [
        ("gstar --n 8 --pressure 0.1 --frame 0", "--frame"),
        ("gstar p.h5 --sizes uniform:0.2", "--sizes"),
        ("gstar p.h5 --seed 1", "--seed"),  # its default, given
        ("analyze p.h5 --model zz", "--model"),
        ("analyze a.png --model sp", "--model"),
        ("analyze a.png --box 9,9", "--box"),
        ("analyze --labels b.png --channel red", "--channel"),
        ("relax p.h5 --box 9,9", "--box"),
        ("jam --model dp --size-ratio 1.2", "--size-ratio"),
        ("decks in.sp.jam --json", "--json"),
        ("estimate rho_J --rho 0.9 --error 0.1", "--rho"),
        ("estimate z --rho 0.9 --error 0.1 --dry-run --seed 2", "--seed"),
    ],
)
def test_what_is_given_and_not_used_is_refused_by_name(asked, line, flag):
    said, log = asked(*line.split())
    assert said.startswith("error: ") and said.count("\n") == 1 and f"{flag} is used only" in said and not log, said


@pytest.mark.parametrize(
    ("line", "flag"),
    [
        ("pack -n 8 --pressure 1e-2 --n 10", "--n"),
        ("jam --seed 1 --seed=2", "--seed"),
        ("shear p.h5 --rate 0.1 --rate 0.2", "--rate"),
        ("compress p.h5 --to 0.9 --first-step 0.001 --first-step 0.002", "--first-step"),
        ("deck in.sp.jam --n 16 --n=32", "--n"),
        ("campaign run c.toml --share 1/2 --share 2/2", "--share"),
    ],
)
def test_an_option_of_one_value_is_given_once(asked, line, flag):
    said, log = asked(*line.split())
    assert said == f"error: {flag} is given twice: give one value\n" and not log


@pytest.mark.parametrize(
    ("line", "again"),
    [
        ("flow-curve p.h5 --rate 0.1 0.2", "--rate 0.1 --rate 0.2"),
        ("flow-curve --rate=0.1 0.2 3e-1 p.h5", "--rate 0.1 --rate 0.2 --rate 3e-1"),
        ("pack -n 8 --phi 0.7 --law k=2 exponent=3", "--law k=2 --law exponent=3"),
        ("shear p.h5 --rate 0.1 --damping contact beta=0.5", "--damping contact --damping beta=0.5"),
        ("campaign plan c.toml --only one two", "--only one --only two"),
        ("gstar p.h5 --damping contact beta=0.5", "--damping contact --damping beta=0.5"),
    ],
)
def test_several_values_behind_an_option_are_answered_by_repeating_it(asked, line, again):
    said, log = asked(*line.split())
    flag = again.split()[0]
    assert said == f"error: {flag} takes one value and is given again for each: {again}\n" and not log


def test_a_word_too_many_is_no_value_of_an_option(asked):
    for line in ("flow-curve --rate 0.1 p.h5 q.h5", "shear p.h5 --rate 0.1 0.2", "pack --law hertz -n 8 --phi 0.7 8"):
        assert "extra argument" in asked(*line.split())[0]


def test_flags_and_options_of_several_values_may_be_repeated(asked):
    for line in (
        "flow-curve p.h5 --rate 0.1 --rate 0.2 --json --json",
        "pack -n 8 --phi 0.7 --law k=2 --law exponent=3",
    ):
        assert "twice" not in asked(*line.split())[0]


READING = COMMANDS.keys() - APART - {"jam", "pack", "demo", "estimate"}


NAMES = {  # of what is read, as what is to be written
    "same": "{0}{1}",
    "spelling": "../{2}/./{0}{1}",
    "folder that is a link": "here/{0}{1}",
    "soft link": "soft{1}",
    "hard link": "hard{1}",
}


WAYS_TO_WRITE = [*((name, "same") for name in sorted(READING)), *(("shear", how) for how in list(NAMES)[1:])]


@pytest.mark.parametrize(("name", "how"), WAYS_TO_WRITE)
def test_no_command_writes_what_it_reads(asked, folder, name, how):
    """Each output against each input, with --overwrite, whatever name the file has."""
    outputs = [each for each in COMMANDS[name].params if each.name in OUTPUTS]
    inputs = [each.name for each in COMMANDS[name].params if each.name in INPUTS]
    assert outputs and inputs
    (folder / "here").is_symlink() or (folder / "here").symlink_to(".")
    for output, read in product(outputs, inputs):
        ending = {"csv": ".csv", "plot": ".png", "overlay": ".png"}.get(output.name, ".h5")
        ending = {"explore": ".html", "gstar": ".csv"}.get(name, ending) if output.name == "out" else ending
        source = folder / f"source{ending}"
        source.write_text("work of a week")
        for link in ("soft", "hard"):
            (folder / f"{link}{ending}").unlink(missing_ok=True)
        (folder / f"soft{ending}").symlink_to(source)
        os.link(source, folder / f"hard{ending}")
        written = NAMES[how].format("source", ending, folder.name)
        _, *needed = WAYS[name][0].split()
        given = ["p.h5", "--labels", source.name] if read == "labels" else [source.name]
        line = [name, *given, *[word for word in needed if word not in ("q.dump", "--out", "q.h5")]]
        line += [written] if output.name == "target" else [output.opts[0], written]
        said, log = asked(*line, "--overwrite")
        assert "it is also the input" in said or "used only for pictures" in said, said
        assert source.read_text() == "work of a week" and not log


def test_two_outputs_are_two_files(asked):
    for line in ("shear p.h5 --rate 1 --csv a --out ./a", "shear p.h5 --rate 1 --csv a --plot ./a"):
        said, log = asked(*line.split(), "--overwrite")
        assert "another option names it too" in said and not log
    said, log = asked(*"analyze a.png --csv a.csv --overlay b.png --out ./c.h5 --overwrite".split())
    assert "cannot write" not in said and log


def test_sizes_from_a_file_are_an_input(asked):
    said, log = asked(*"pack --n 8 --pressure 0.1 --sizes from-file:d.h5 --out ./d.h5 --overwrite".split())
    assert "it is also the input" in said and not log


def test_the_shell_can_say_all_that_python_can_of_a_file():
    python = set(inspect.signature(jamlab.read).parameters) - {"path", "frame"}
    assert {*inspect.signature(how_to_read).parameters} == python


@pytest.mark.parametrize(
    ("line", "how"),
    [
        ("--box 9,8 --units k", {"box": [9, 8], "units": "k"}),
        ("--box 9,0,1,8", {"box": [[9, 0], [1, 8]]}),
        ("--radii 0.5", {"radii": 0.5}),
        ("--radii 1=0.5,2=0.7 --law k=2", {"radii": {"1": 0.5, "2": 0.7}, "law": {"k": 2}}),
        ("--model dp --atom-style bond", {"model": "dp", "atom_style": "bond"}),
        ("--box 9", "give two sides"),
        ("--box 9,a", "'a' is no number"),
        ("--radii 1=0.5,0.7", "one for each type"),
        ("--radii 1=0.5,1=0.7", "one for each type"),
        ("--law hertz --law sticky", "named already"),
        ("--law k=2 --law k=3", "k is given twice"),
    ],
)
def test_what_a_file_of_another_program_lacks(asked, line, how):
    said, log = asked("relax", "p.xyz", *line.split())
    if isinstance(how, str):
        assert said.startswith("error: ") and how in said and not log
    else:
        assert literal_eval(log[0].partition("-1), ")[2][:-1]) == how


@pytest.mark.parametrize("name", ["n", "seed", "progress", "size_ratio", "force_tolerance"])
def test_parameters_of_a_force_law_are_no_other_arguments(folder, name):
    for command in ("jam", "pack --pressure 1e-2"):
        done = call(folder, *command.split(), "--n", "8", "--law", f"{name}=9", "--out", "law.h5")
        said = f"--law {name}=9: the force law of model sp has no parameter '{name}'"
        assert said in done.stderr and not (folder / "law.h5").exists()


@pytest.mark.parametrize(
    "line",
    [
        "analyze table.csv",
        "relax table.csv --box 9,9",
        "jam --n 8 --search incremental --ensemble shear-stabilized",
        "gstar",
        "pack --n 8",
        "pack --n 8 --pressure 1e-2 --phi 0.8",
        "shear p.h5 --rate 0.1 --within nan",
        "flow-curve p.h5 --rate 0.1 --workers 0",
        "analyze labels.npy",
        "deck in.sp.shear",
    ],
)
def test_messages_of_the_shell_speak_of_options(folder, line):
    (folder / "table.csv").write_text("x,y\n0.5,0.5\n1.4,0.5\n")
    said = call(folder, *line.split()).stderr
    assert "rror" in said and "--" in said and not re.search(r"\w=[^0-9A-Z]|None|\w+\(", said.split("rror", 1)[1]), said
