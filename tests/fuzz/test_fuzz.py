"""Files and command lines at random: an honest result, or exit code 1 or 2 with a message; nothing written, no hang.

Each kind runs a few fixed examples by default and 1000 new ones with `-m slow`. What failed once is a plain test beside
the others of its module.
"""

import contextlib
import os
import signal

import campaigns
import numpy as np
import pytest
from commands import call
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from wandering_packings import disks, polygons

import jamlab
from jamlab.storage.verified_file import USER_BLOCK, add_checksum

SECONDS = 30  # after which an example counts as a hang

twice = pytest.mark.parametrize("examples", [8, pytest.param(1000, marks=pytest.mark.slow)])
numbers = st.sampled_from([0.0, -1.0, 1e300, -1e300, 1e-300, 5e-324, 1e17, np.inf, -np.inf, np.nan, 0.5, 3.0])
WORDS = """nan inf -inf 1e300 -1 0 1e-320 x [red] [/] {} %s # ITEM: Atoms é true 3.5 1e400 -0 0x10 [ ] " sp dp"""
words = st.sampled_from([*WORDS.split(), "", "\0", "\n", "1 2", "9" * 30, "9" * 5000])


def try_all(test, examples, **given_by):
    """Run a function on so many examples: always the same few, or many new ones."""
    phases = [Phase.explicit, Phase.generate]  # shrinking takes minutes, and the draws are printed anyway
    calm = {"database": None, "deadline": None, "suppress_health_check": list(HealthCheck)}
    how = settings(max_examples=examples, derandomize=examples < 100, phases=phases, **calm)
    how(given(**given_by)(test))()


@contextlib.contextmanager
def in_time():
    def stop(*_):
        raise AssertionError(f"hangs: not done after {SECONDS} s")

    old = signal.signal(signal.SIGALRM, stop)
    signal.alarm(SECONDS)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, old)


def assert_harmless(folder, *command):
    before = {name: (folder / name).stat().st_mtime_ns for name in os.listdir(folder)}
    with in_time():
        done = call(folder, *command)  # which asserts that nothing but SystemExit comes out
    assert done.exit_code in (0, 1, 2)
    assert done.exit_code == 0 or done.stderr.strip()
    assert "fault of jamlab" not in done.stderr
    assert {name: (folder / name).stat().st_mtime_ns for name in os.listdir(folder)} == before


def damage_bytes(content, data):
    """Cut, flip or overwrite."""
    content = bytearray(content)
    place = data.draw(st.integers(0, len(content) - 1))
    match data.draw(st.sampled_from(["cut", "flip", "overwrite"])):
        case "cut":
            del content[place:]
        case "flip":
            content[place] ^= 1 << data.draw(st.integers(0, 7))
        case "overwrite":
            part = data.draw(st.binary(min_size=1, max_size=16))
            content[place : place + len(part)] = part
    return bytes(content)


@pytest.mark.parametrize("make", [disks, polygons])
@twice
def test_hdf5(tmp_path, make, examples):
    path = tmp_path / "run.h5"
    jamlab.write(path, [make(1, 0.3), make(1, 0.3)], {"g": [1.0, 2.0]})
    whole = path.read_bytes()

    def run(data):
        path.write_bytes(damage_bytes(whole, data))
        if path.read_bytes() != whole:
            with in_time(), pytest.raises(jamlab.JamlabError):  # the checksum must notice
                jamlab.read_all(path)
        path.write_bytes(add_checksum(damage_bytes(whole[USER_BLOCK:], data)))  # or what was damaged before
        assert_harmless(tmp_path, "analyze", path.name)

    try_all(run, examples, data=st.data())


def damage_text(text, data):
    """Replace, double, swap or drop words and lines; or cut, or put other bytes in."""
    lines = text.splitlines(keepends=True)
    for _ in range(data.draw(st.integers(1, 3))):
        if not lines:
            break
        place = data.draw(st.integers(0, len(lines) - 1))
        kind = data.draw(st.sampled_from(["word", "word", "drop", "double", "swap", "cut", "insert"]))
        if kind == "word" and lines[place].split():
            parts = lines[place].split(" ")
            parts[data.draw(st.integers(0, len(parts) - 1))] = data.draw(words)
            lines[place] = " ".join(parts)
        elif kind == "drop":
            del lines[place]
        elif kind == "double":
            lines.insert(place, lines[place])
        elif kind == "swap":
            other = data.draw(st.integers(0, len(lines) - 1))
            lines[place], lines[other] = lines[other], lines[place]
        elif kind == "cut":
            lines[place:] = [lines[place][: data.draw(st.integers(0, len(lines[place])))]]
        elif kind == "insert":
            lines.insert(place, data.draw(words) + "\n")
    content = "".join(lines).encode()
    return damage_bytes(content, data) if content and data.draw(st.integers(0, 4)) == 0 else content


@pytest.mark.parametrize("make", [disks, polygons])
@pytest.mark.parametrize("suffix", ["data", "dump"])
@twice
def test_lammps_text(tmp_path, make, suffix, examples):
    path = tmp_path / f"run.{suffix}"
    if suffix == "data":
        jamlab.write(path, make(1, 0.3))
    else:
        jamlab.write(path, [make(1, 0.0), make(1, 0.3)])
    text = path.read_text()

    def run(data):
        path.write_bytes(damage_text(text, data))
        assert_harmless(tmp_path, "analyze", path.name)

    try_all(run, examples, data=st.data())


toml_keys = st.sampled_from(["to", "lowest", "ka", "contact", "a"])
toml_values = st.recursive(
    numbers.map(lambda value: "nan" if np.isnan(value) else repr(value))
    | st.sampled_from(["9" * 40, *"""1 16 -3 true "sp" "dp" "x" "" 1979-05-27 0xff 7:00:00""".split()]),
    lambda inner: (
        st.lists(inner, max_size=3).map(lambda parts: "[" + ", ".join(parts) + "]")
        | st.tuples(toml_keys, inner).map(lambda p: f"{{ {p[0]} = {p[1]} }}")
    ),
    max_leaves=5,
)


@twice
def test_campaign_files(tmp_path, examples):
    path = tmp_path / "c.toml"
    keys = sorted(jamlab.campaign.file.SweepTable.model_fields)

    def run(data):
        text = campaigns.FULL
        if data.draw(st.booleans()):
            lines = text.splitlines()
            places = [k for k, line in enumerate(lines) if " = " in line]
            for place in data.draw(st.lists(st.sampled_from(places), min_size=1, max_size=3)):
                key = data.draw(st.sampled_from([lines[place].split(" = ")[0], *keys]))
                lines[place] = f"{key} = {data.draw(toml_values)}"
            path.write_text("\n".join(lines))
        else:
            path.write_bytes(damage_text(text, data))
        assert_harmless(tmp_path, "campaign", data.draw(st.sampled_from(["plan", "status"])), path.name)

    try_all(run, examples, data=st.data())


COMMANDS = {  # each with an option or argument that nothing can start from
    ("jam", "--out", "absent/o.h5"): [
        "--model",
        "--n",
        "--seed",
        "--law",
        "--search",
        "--ensemble",
        "--force-tolerance",
    ],
    ("jam", "--model", "tp"): ["--n", "--seed", "--out", "--force-tolerance"],
    ("pack", "--out", "absent/o.h5"): ["--n", "--pressure", "--seed", "--ensemble", "--force-tolerance"],
    ("compress", "absent.h5"): ["--to", "--step", "--first-step", "--frame", "--out", "--by"],
    ("compress", "run.h5", "--out", "."): ["--to", "--step", "--first-step", "--frame"],
    ("analyze", "absent.h5"): ["--pixel", "--film", "--contrast"],
    ("analyze", "run.h5"): ["--pixel", "--film", "--json"],
    ("gstar", "absent.h5"): ["--out", "--damping", "--direction", "--n", "--pressure", "--seed", "--points"],
    ("campaign", "plan", "absent.toml"): ["--folder", "--workers", "--only"],
    ("campaign", "export", "c.toml", "--out", "run.h5"): ["--format", "--table", "--sweep", "--folder"],
    ("campaign", "status", "c.toml"): ["--folder", "--verify"],
    ("campaign", "run", "c.toml", "--workers", "0"): ["--share", "--only", "--folder"],
}


@twice
def test_command_lines(tmp_path, examples):
    jamlab.write(tmp_path / "run.h5", [disks(1, 0.3)])
    campaigns.written(tmp_path / "c.toml")
    unwritable = st.sampled_from(["/dev/full", "/dev/null/x", "a" * 300, "absent/x", "run.h5/x", "\0", "/proc/x"])

    def run(data):
        command = data.draw(st.sampled_from(list(COMMANDS)))
        options = []
        for option in data.draw(st.lists(st.sampled_from(COMMANDS[command]), max_size=3)):
            options += [option, data.draw(unwritable if option in ("--out", "--folder") else words)]
        assert_harmless(tmp_path, *command, *options)

    try_all(run, examples, data=st.data())


def test_brackets_of_a_file_are_no_markup(tmp_path):
    """Found above: a closing tag in a message ended in a traceback."""
    jamlab.write(tmp_path / "run.data", polygons(1, 0.3))
    text = (tmp_path / "run.data").read_text()
    (tmp_path / "run.data").write_text(text.replace(" ", " [/] ", 1).replace("\n1 ", "\n[/] ", 1))
    assert_harmless(tmp_path, "analyze", "run.data")
    assert_harmless(tmp_path, "analyze", "[/].h5")
