"""Decks run in plain lmp and give what the Python engine gives; `jamlab deck` checks their variables."""

import re
import subprocess

import deck_runs
import numpy as np
import pytest
from commands import call
from deck_runs import number, run, table

import jamlab
from jamlab.cli import decks
from jamlab.engine.deck_defaults import LIMITS, settings
from jamlab.engine.deck_files import copy_decks, summaries
from jamlab.flow import overdamped_session
from jamlab.installed_files import installed
from jamlab.packing.deformation import at_phi
from jamlab.packing.lammps_files import described
from jamlab.protocols.random_start import droplet_cell, droplet_params, place_droplets, random_disks
from jamlab.rheology.damping import DRAG_LIMITS

DECKS = sorted(path.name for path in installed("lammps_inputs").glob("in.*"))
FREE = {"data", "out", "dir", "model", "table", "strict", "quote", "quiet"}  # texts, and what jamlab deck sets


def stress_of(packing):
    stress = jamlab.evaluate(packing).stress
    return float(np.hypot(0.5 * (stress[0, 0] - stress[1, 1]), stress[0, 1]))


@pytest.fixture
def given(tmp_path, dense):
    """The folder of a test with the file of a packing of disks in it."""
    jamlab.write(tmp_path / "packing.data", dense)
    jamlab.write(tmp_path / "sp.dump", [dense])
    return tmp_path


@pytest.mark.parametrize("deck", DECKS)
def test_every_variable_has_limits_that_hold_its_default(deck):
    path = installed("lammps_inputs") / deck
    known = settings(path.parent, deck)
    assert {"force_tolerance", "steps", "out"} <= known.keys()
    for name in set(decks.offered(path)) - FREE - {"d1", "d2"}:
        decks.check_setting(path, name, known[name])


def interval(deck, name):
    """Ends of the interval that a deck says behind the default of a variable; empty where it says none."""
    said = settings(installed("lammps_inputs"), deck, what=LIMITS).get(name, "")
    return [float(end) for end in re.findall(r"[\d.e-]*\d", said)]


def test_drag_in_decks_has_the_limits_of_python():
    assert interval("in.sp.startup", "alpha") == [DRAG_LIMITS.alpha, 1]
    assert interval("in.sp.startup", "beta") == [0, overdamped_session.FLOW_LIMITS.largest_beta]


@pytest.mark.parametrize(
    ("deck", "name", "value"),
    [
        ("in.sp.jam", "gama", 7),
        ("in.sp.jam", "n", 7),
        ("in.sp.jam", "to", 5),
        ("in.sp.jam", "units", "foo"),
        ("in.sp.jam", "eps", 0),
        ("in.dp.jam", "eps", 1e300),
        ("in.sp.jam", "force_tolerance", -1e-9),
        ("in.sp.jam", "skin", "nan"),
        ("in.dp.jam", "contact", "foo"),
        ("in.sp.startup", "alpha", 0.3),
        ("in.sp.shear", "data", "absent.data"),
        ("in.dp.shear", "data", "packing.data"),
        ("in.sp.shear", "units", "k"),
        ("in.sp.shear", "d2", 2),
        ("in.sp.shear", "d2", "wide"),
        ("in.sp.shear", "size_ratio", 1.4),
        ("in.sp.shear", "data", "sp.dump"),
        ("in.sp.absent", "n", 8),
    ],
)
def test_jamlab_deck_refuses_by_name_and_value(given, deck, name, value):
    data = {} if name == "data" or "jam" in deck or "absent" in deck else {"data": "packing.data"}
    words = [word for key, text in {**data, name: value}.items() for word in (f"--{key}", str(text))]
    done = call(given, "deck", deck, *words)
    assert done.exit_code == 1 and (name in done.stderr or str(value) in done.stderr or deck in done.stderr)
    assert sorted(path.name for path in given.iterdir()) == ["packing.data", "sp.dump"]


def test_help_lists_variables_with_defaults_and_ranges(given):
    done = call(given, "deck", "in.sp.jam", "--help")
    assert done.exit_code == 0
    rows = dict(line.split(maxsplit=1) for line in done.stdout.splitlines() if line.startswith("--"))
    known = settings(installed("lammps_inputs"), "in.sp.jam").keys() - FREE
    assert rows.keys() == {f"--{name.replace('_', '-')}" for name in known | {"out"}}
    assert rows["--force-tolerance"].endswith("; largest component of a force at a minimum")
    assert rows["--n"].split()[0] == "64" and "even" in rows["--n"]
    assert sorted(path.name for path in given.iterdir()) == ["packing.data", "sp.dump"]


def test_a_rerun_says_which_file_it_replaces(tmp_path):
    """The first line of each run is the law in use."""
    for _ in range(2):
        run("in.sp.jam", tmp_path, n=4, to=0.87)
    lines = (tmp_path / "sp.txt").read_text().splitlines()
    assert [line.split()[1] for line in lines if line.startswith("REPLACED")] == ["sp.onset.data"]
    assert [described([line])["eps"] for line in lines if line.startswith("#")] == [1.0, 1.0]


def test_a_search_without_minima_ends(tmp_path):
    run("in.sp.jam", tmp_path, code=2, n=16, steps=10)
    assert "NO ONSET" in (tmp_path / "sp.txt").read_text()


@pytest.mark.parametrize(
    ("deck", "settings", "words"),
    [
        ("sp.jam", {"n": -4}, "n = -4: must be an even number in [2, 1e6]"),
        ("sp.jam", {"n": "1e2"}, "n = 1e2: must be an even number in [2, 1e6], in digits"),
        ("sp.jam", {"step": 0}, "step = 0: must be a number in (0, 1]"),
        ("sp.jam", {"phi": 0.8}, "-var phi: the deck sets it itself"),
        ("sp.jam", {"ratio": 1.2, "untis": "k"}, "-var ratio: no such variable; give size_ratio"),
        ("sp.jam", {"seed": ("1", "2")}, "-var seed gives 2 values: give one"),
        ("sp.jam", {"untis": "k"}, "-var untis: no such variable; give units"),
        ("sp.jam", {"minimizer": "sd"}, "minimizer = sd: must be one of cg | fire"),
        ("sp.jam", {"force_tolerance": 1e-6}, "-var u_contact 1e-10 -var u_jammed 1e-08"),
        ("dp.jam", {"n": 4, "force_tolerance": 1e-4}, "-var u_contact 1e-06 -var u_jammed 0.0001"),
        ("dp.jam", {"units": "k"}, "units = k: droplets have eps"),
        ("dp.jam", {"nv_small": 16}, "nv_small = 16, nv_large = 17: a random start reads polygonN.mol of both"),
        ("dp.jam", {"ka": 0.01}, "ka = 0.01: free droplets collapse under gamma = 0.4; give ka above 3.288"),
        ("sp.jam", {"d1": 1, "size_ratio": 1.2}, "size_ratio = 1.2 beside d1 or d2"),
        ("sp.jam", {"units": "k", "eps": 3}, "eps = 3: units = k have the strength k"),
        ("sp.jam", {"u_jammed": 1e-17}, "u_jammed = 1e-17: must be above u_contact = 1e-16"),
        ("sp.compress", {"data": "packing.data", "search_step": 0.1}, "-var search_step: no such variable"),
        ("dp.startup", {"data": "packing.data", "even": 0.1}, "-var even: no such variable"),
        ("sp.startup", {"data": "packing.data", "rate": 0}, "rate = 0: must be a number in [1e-12, 1000]"),
        ("sp.shear", {"data": "packing.data", "size_ratio": 1.2}, "was made with 1.4; leave it out"),
        ("sp.shear", {"data": "packing.data", "units": "k"}, "units = k: packing.data was made with eps"),
        ("sp.shear", {"data": "packing.data", "d2": 2}, "d2 = 2: packing.data was made with 1.1666"),
        ("dp.shear", {"data": "packing.data"}, "data = packing.data: it holds disks, but this deck takes droplets"),
        ("sp.shear", {"data": "sp.dump"}, "data = sp.dump: no data file of LAMMPS"),
        ("sp.shear", {"data": "absent.data"}, "there is no file absent.data: give -var data FILE"),
        ("sp.shear", {"data": "plain.data"}, "plain.data says no law"),
    ],
)
def test_a_deck_alone_refuses(given, deck, settings, words):
    """On the screen, in the log and in the table; nothing else has run, and no file is made."""
    lines = (given / "packing.data").read_text().splitlines(keepends=True)
    (given / "plain.data").write_text("".join(line for line in lines if not line.startswith("# jamlab")))
    files = set(given.iterdir())
    out = run(f"in.{deck}", given, code=1, law=False, table="t.txt", words=("-log", "log"), **settings)
    assert [words in (given / name).read_text() for name in ("log", "t.txt")] == [True, True]
    assert f"{words}" in out and "Loop time" not in out
    assert {path.name for path in set(given.iterdir()) - files} == {"log", "t.txt"}


def test_a_deck_in_a_deck_leaves_the_variables_of_its_user_alone(given):
    """Those that print or compute have no value before there is a box. What is no -var is not refused as one."""
    (given / "in.mine").write_text(
        "variable data index packing.data\nvariable volume equal vol\nvariable shown format volume %.3f\n"
        "variable mine getenv PATH\ninclude ${dir}/in.sp.contacts\nprint 'volume ${shown}'\n"
    )
    assert "\nvolume " in run("in.mine", given, inputs=given, law=False, dir=installed("lammps_inputs"))


def test_a_deck_reads_the_law_of_a_file_and_prints_tables_alone(given, dense):
    """Law and sizes need not be given; what LAMMPS prints is in the log."""
    out = run("in.sp.shear", given, law=False, data="packing.data", words=("-log", "log"))
    assert number("modulus G_xy", out) == pytest.approx(jamlab.shear_modulus(dense, direction="simple"), rel=1e-3)
    assert len(out.splitlines()) < 12 and "Loop time" not in out
    log = (given / "log").read_text()
    assert "Loop time" in log and "relaxed shear modulus" in log
    assert "Loop time" in run("in.sp.shear", given, data="packing.data", quiet="no")


def test_an_input_file_runs_decks_one_after_the_other(tmp_path):
    """It defines what it likes, and each deck of it begins anew."""
    lines = ["variable turn loop 2", "variable mine equal 3", "variable n index 4", "label next", "clear"]
    lines += ["variable seed delete", "variable seed index ${turn}", 'include "${dir}/in.sp.jam"']
    (tmp_path / "in.mine").write_text("\n".join([*lines, "next turn", "jump SELF next", ""]))
    run(tmp_path / "in.mine", tmp_path, to=1.0)
    both = (tmp_path / "sp.txt").read_text()
    for seed in (1, 2):
        run("in.sp.jam", tmp_path, seed=seed, n=4, to=1.0, out="one")
    found = [re.findall(r"phi_J = (\S+)", text) for text in (both, (tmp_path / "one.txt").read_text())]
    assert len(found[0]) == 2 and found[0] == found[1]


def test_lammps_without_the_plugin_runs_decks_of_disks(given, monkeypatch):
    """It checks no variables, and says so; a file of other sizes is no state at rest."""
    monkeypatch.setattr(deck_runs, "program_environment", lambda: {"LAMMPS_PLUGIN_PATH": ""})
    out = run("in.sp.jam", given, n=4, to=0.87, gama=1, out="x")
    assert re.search(r"NOT CHECKED.*\n(.*\n)*Variable.* gama", out) and "Loop time" in out
    run("in.sp.shear", given, law=False, data="packing.data", units="eps", size_ratio=1.2)
    assert re.search("^NOT AT REST: packing.data has forces up to 0.1", (given / "sp.txt").read_text(), re.MULTILINE)


def test_copied_decks_use_their_own_parts(tmp_path):
    folder = copy_decks(tmp_path / "decks")
    assert list(summaries(folder)) == DECKS
    part = folder / "parts" / "dp"
    part.write_text(part.read_text().replace("variable gamma        index 0.4 ", "variable gamma        index 0.3 "))
    short = {"n": 4, "steps": 1, "search_step": 0.1, "increment_least": 0.09, "phi_start": 0.1}
    run("in.dp.jam", tmp_path, code=2, inputs=folder, out="mine", **short)
    assert described((tmp_path / "mine.failed.data").read_text().splitlines())["gamma"] == 0.3
    with pytest.raises(jamlab.StorageError):
        copy_decks(folder)


ODD = "my ä b' $x#&中"  # a folder: every letter may stand in one, but for the quotation mark by which decks quote


@pytest.mark.parametrize("deck", [pytest.param("in.sp.jam", marks=pytest.mark.slow), "in.dp.jam"])  # with molecules
def test_decks_run_in_a_folder_of_any_name(tmp_path, deck):
    """By `jamlab deck` in that folder, and by plain lmp from outside, which looks for parts and molecules there."""
    folder = copy_decks(tmp_path / ODD)
    short = {"n": 2, "to": 0.9, "step": 0.1, "phi_start": 0.3}
    settings = [word for name, value in short.items() for word in (f"--{name.replace('_', '-')}", value)]
    done = call(folder, "deck", deck, *settings)
    assert done.exit_code == 0, done.stderr
    line = [deck_runs.LMP, "-in", f"{ODD}/{deck}", "-var", "dir", ODD]
    line += [word for name, value in short.items() for word in ("-var", name, str(value))]
    alone = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert alone.returncode == 0 and alone.stdout.splitlines()[-2] in done.stdout
    assert len(alone.stdout.splitlines()) < 60 < (tmp_path / "log.lammps").read_text().count("\n")


def test_decks_in_a_folder_with_a_quotation_mark_are_refused_by_name(tmp_path):
    folder = copy_decks(tmp_path / 'so "named"')
    done = call(folder, "deck", "in.sp.jam", "--n", 4)
    assert done.exit_code == 1 and 'so "named"' in done.stderr and "decks --copy" in done.stderr


def test_polygon_templates_are_regular_and_of_unit_area():
    for nv in (12, 17):
        lines = (installed("lammps_inputs") / "parts" / f"polygon{nv}.mol").read_text().splitlines()
        start = lines.index("Coords") + 2
        x = np.array([[float(w) for w in line.split()[1:3]] for line in lines[start : start + nv]])
        y = np.roll(x, -1, axis=0)
        assert 0.5 * np.sum(x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0]) == pytest.approx(1.0, abs=1e-14)
        assert np.ptp(np.hypot(*(y - x).T)) < 1e-14


def test_jam_finds_an_onset_and_compresses(tmp_path):
    """By `jamlab deck`, whose table goes to the screen; then in.sp.shear takes the file to another phi."""
    line = [deck_runs.LMP.parent / "jamlab", "deck", "in.sp.jam", "--n", "32", "--seed", "4", "--to", "0.86"]
    text = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    assert 0.78 < number("phi_J", text) < 0.87 and 1e-16 <= number("with u", text) <= 1e-13
    assert deck_runs.rows(text, 4)[:, 3].max() <= 1e-12
    sheared = run("in.sp.shear", tmp_path, data="sp.onset.data", to=0.95)
    assert np.isfinite(number("modulus G_xy", sheared))


def test_shear_gives_the_modulus_of_linear_response(given, dense):
    text = run("in.sp.shear", given, data="packing.data", strain=3e-7, strain_step=1e-7)
    assert table(given)[:, 0] == pytest.approx([0, 1e-7, 2e-7, 3e-7], rel=1e-5)
    assert number("modulus G_xy", text) == pytest.approx(jamlab.shear_modulus(dense, direction="simple"), rel=1e-3)
    assert number("error", text) < 1e-3 * number("modulus G_xy", text)
    text = run("in.sp.shear", given, code=2, data="packing.data", strain_step=1e-14)
    assert "\nNO MODULUS" in text and "relaxed shear modulus" not in text


@pytest.mark.parametrize(("to", "first_step"), [(0.9, 1e-4), (0.96, None)])
def test_compress_goes_through_the_states_of_python(given, dense, to, first_step):
    """Down by log-spaced steps, up by equal ones."""
    states = list(jamlab.compress(dense, to, 0.01, by="phi", first_step=first_step))
    run("in.sp.compress", given, data="packing.data", to=to, first_step=first_step or 0, step=0.01)
    found, evaluated = table(given), [jamlab.evaluate(state) for state in states]
    assert found[:, 0] == pytest.approx([state.phi for state in states], abs=1e-9)
    assert found[:, 1] == pytest.approx([e.energy / dense.n for e in evaluated], rel=1e-8)
    assert found[:, 2] == pytest.approx([e.pressure for e in evaluated], rel=1e-8)
    assert found[:, 3].max() <= 1e-12
    last = jamlab.read(given / "sp.compressed.data")
    assert jamlab.evaluate(last).pressure == pytest.approx(found[-1, 2], rel=1e-9)
    frame = jamlab.read(given / "sp.dump", frame=len(states))
    assert np.allclose(frame.diameters, dense.diameters, rtol=1e-14) and frame.phi == pytest.approx(last.phi, rel=1e-12)


@pytest.mark.parametrize("deck", ["compress", "shear", "bulk", "stabilize", "minimize"])
def test_without_a_minimum_a_deck_fails_and_gives_no_number(tmp_path, dense, deck):
    jamlab.write(tmp_path / "packing.data", at_phi(dense, dense.phi + 0.01))
    text = run(f"in.sp.{deck}", tmp_path, code=2, data="packing.data", steps=3)
    assert "modulus" not in (tmp_path / "sp.txt").read_text() and "NOT CONVERGED" in text
    assert {path.name for path in tmp_path.glob("*.data")} == {"packing.data", "sp.failed.data"}
    entries = described((tmp_path / "sp.failed.data").read_text().splitlines())
    assert entries["converged"] is False and entries["max_force"] > 1e-12


@pytest.mark.parametrize(
    ("deck", "state", "settings"),
    [
        ("compress", None, {"to": 0.5, "first_step": 0, "step": 0.05}),  # nothing touches
        ("stabilize", 1e-3, {}),  # no shear of the box keeps this one jammed
        ("bulk", None, {"strain_step": 0.02, "halvings": 1}),  # contacts change
        ("bulk", None, {"to": 0.7}),  # nothing touches
        ("shear", None, {"to": 0.7}),
        ("pressure", None, {"n": 32, "seed": 3, "tries": 2}),
    ],
)
def test_what_cannot_be_reached_ends_with_code_2(given, deck, state, settings):
    if state:
        jamlab.write(given / "packing.data", jamlab.pack(32, state, 1))
    data = {} if deck == "pressure" else {"data": "packing.data"}
    assert "modulus" not in run(f"in.sp.{deck}", given, code=2, **data, **settings)
    assert {path.name for path in given.glob("*.data")} == {"packing.data", "sp.failed.data"}


@pytest.mark.parametrize("pressure", [3e-2, 1e-4])
def test_pressure_is_met(tmp_path, pressure):
    run("in.sp.pressure", tmp_path, n=32, seed=3, pressure=pressure)
    state = jamlab.evaluate(jamlab.read(tmp_path / "sp.pressure.data"))
    assert state.pressure == pytest.approx(pressure, rel=1e-6) and state.max_force < 2e-12


def test_stabilize_and_bulk(given, dense):
    """Without residual shear stress at the same area; B of a square and of a tilted box as by linear response."""
    assert number("modulus B", run("in.sp.bulk", given, data="packing.data")) == pytest.approx(
        jamlab.bulk_modulus(dense), rel=1e-6
    )
    text = run("in.sp.bulk", given, data="packing.data", strain_step=0.02)
    assert number("strain_step", text) < 0.02 and number("modulus B", text) == pytest.approx(
        jamlab.bulk_modulus(dense), rel=0.01
    )
    (state,) = jamlab.compress(dense, 0.9, 1.0, by="phi")
    text = run("in.sp.bulk", given, data="packing.data", to=0.9)
    assert number("modulus B", text) == pytest.approx(jamlab.bulk_modulus(state), rel=1e-6)

    assert stress_of(dense) > 0.03 * jamlab.evaluate(dense).pressure
    run("in.sp.stabilize", given, data="packing.data")
    stable = jamlab.read(given / "sp.stable.data")
    assert stress_of(stable) < 1.1e-6 * jamlab.evaluate(stable).pressure
    assert jamlab.evaluate(stable).energy < jamlab.evaluate(dense).energy
    assert stable.area == pytest.approx(dense.area, rel=1e-13) and abs(stable.box[1, 0]) > 0.01
    assert jamlab.shear_modulus(stable, direction=np.linspace(0, np.pi, 20)).min() > 0
    text = run("in.sp.bulk", given, data="sp.stable.data")
    assert number("modulus B", text) == pytest.approx(jamlab.bulk_modulus(stable), rel=1e-6)


@pytest.mark.parametrize("ranks", [1, 2])
def test_contacts(tmp_path, random_disks, ranks):
    """Three sizes in a tilted box, with disks that only rattle once others are taken out."""
    packing = random_disks(tilt=0.3, n=40, phi=0.75)
    network = jamlab.contacts(packing)
    few = np.bincount(network.pairs.ravel(), minlength=packing.n) < 3
    assert 0 < few.sum() < network.rattlers.sum() < packing.n
    jamlab.write(tmp_path / "packing.data", packing)
    text = run("in.sp.contacts", tmp_path, ranks=ranks, data="packing.data")
    found = [number(name, text) for name in ("n_contacts", "n_backbone", "rattlers", "isostatic")]
    assert found == [network.n_contacts, network.n_backbone, network.rattlers.sum(), network.isostatic]
    assert number("z", text) == pytest.approx(network.z, abs=1e-14)
    columns = np.loadtxt(tmp_path / "sp.contacts.dump", skiprows=9)[:, 5:7]
    degree = np.bincount(network.pairs[network.bearing].ravel(), minlength=packing.n)
    assert np.array_equal(columns[~network.rattlers, 0], degree[~network.rattlers])
    assert np.array_equal(columns[:, 1].astype(bool), network.rattlers)


@pytest.mark.parametrize("units", ["eps", "k"])
def test_hessian(tmp_path, random_disks, units):
    """Finite differences of LAMMPS forces against the analytic Hessian, prestress included."""
    packing = random_disks(units=units)
    jamlab.write(tmp_path / "packing.data", packing)
    run("in.sp.hessian", tmp_path, data="packing.data")
    n = packing.n
    found = np.loadtxt(tmp_path / "sp.hessian.txt").reshape(n, 3, n, 3)[:, :2, :, :2].reshape(2 * n, 2 * n)
    assert found == pytest.approx(jamlab.hessian(packing).toarray(), abs=1e-6)


def test_minimize_keeps_every_digit_of_the_law_of_any_number_of_sizes(tmp_path):
    p = jamlab.pack(n=40, pressure=1e-2, seed=3, sizes="lognormal:0.4")
    jamlab.write(tmp_path / "packing.data", p)
    energy = number("energy", run("in.sp.minimize", tmp_path, data="packing.data"))
    kept = jamlab.read(tmp_path / "sp.minimum.data")
    assert energy == pytest.approx(jamlab.evaluate(kept).energy, rel=1e-12) and kept.converged
    assert np.array_equal(kept.diameters, p.diameters) and (kept.units, kept.phi) == (p.units, p.phi)
    jamlab.write(tmp_path / "packing.data", random_disks(65, 1, phi=0.5, sizes="lognormal:0.3"))
    with pytest.raises(jamlab.InputError):
        run("in.sp.minimize", tmp_path, data="packing.data")


def test_shear_of_droplets_follows_python(tmp_path):
    *_, packing = jamlab.compress(jamlab.jam(8, "dp", 3), 0.9, 0.1)
    jamlab.write(tmp_path / "packing.data", packing)
    run("in.dp.shear", tmp_path, code=2, data="packing.data", strain_step=1e-4, force_tolerance=1e-8)
    text = run("in.dp.shear", tmp_path, data="packing.data", strain_step=1e-5)
    assert jamlab.read(tmp_path / "dp.sheared.data").converged
    exact, error = jamlab.shear_modulus(packing, direction="simple"), number("error", text)
    assert abs(number("modulus G_xy", text) - exact) <= error < 0.1 * exact


def test_droplets_of_another_law(tmp_path):
    """None of gamma, ka, delta and contact is the default."""
    law = {"gamma": 0.7, "ka": 200.0, "delta": 0.2, "contact": "segment/smooth"}
    nv, params = droplet_params(4, **law)
    side = droplet_cell(nv, params, 0.5)
    centres = side * np.array([[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]])
    jamlab.write(tmp_path / "p.data", place_droplets(centres, np.diag([side, side]), nv, params, seed=1))
    run("in.dp.shear", tmp_path, code=2, data="p.data", steps=1)
    entries = described((tmp_path / "dp.failed.data").read_text().splitlines())
    assert {name: entries[name] for name in law} == law
    for nv, code in ((12, 2), (13, 1)):  # not a minimum; rest areas are those of 12 and 17 vertices
        words = ("--to", 0.5, "--nv_small", nv, "--steps", 1)
        assert call(tmp_path, "deck", "in.dp.shear", "--data", "p.data", *words).exit_code == code


COLUMNS = "time strain rate stress elastic_stress viscous_stress pressure normal_stress_difference dissipation".split()
COLUMNS += ["energy", "iterations"]


@pytest.fixture(scope="module")
def packing():
    return jamlab.pack(n=32, pressure=1e-2, seed=3)


def flow(folder, packing, deck, **variables):
    """Columns of the table by name, and the output, of a deck that starts from a packing."""
    jamlab.write(folder / "packing.data", packing)
    text = run(deck, folder, data="packing.data", **variables)
    rows = table(folder, 11, "iterations", packing.model)
    return dict(zip(COLUMNS, rows.T, strict=True)), text


def test_startup(tmp_path, packing):
    """Stress from eta_inf on, to a packing past a flip of its box, which Python reads with the same energy."""
    rows, text = flow(tmp_path, packing, "in.sp.startup", rate=0.1, strain=0.7, rows=7, beta=0.5)
    assert rows["strain"] == pytest.approx(np.linspace(0, 0.7, 8), abs=1e-6)
    limit = jamlab.complex_modulus(packing, [1.0], jamlab.ContactDamping(beta=0.5)).eta_inf
    assert rows["viscous_stress"][0] == pytest.approx(0.1 * limit, rel=1e-3)
    assert rows["stress"] == pytest.approx(rows["elastic_stress"] + rows["viscous_stress"], rel=1e-3)
    assert number("work", text) == pytest.approx(number("dissipated", text) + np.diff(rows["energy"]).sum(), rel=0.02)
    state = jamlab.read(tmp_path / "sp.flow.data")
    assert state.converged is False and abs(state.box[1, 0]) < 0.56 * state.box[0, 0]
    assert jamlab.evaluate(state).energy / state.area == pytest.approx(rows["energy"][-1], rel=1e-5)


def test_oscillate(tmp_path, packing):
    """Strain over strain rate is as asked for; a cycle dissipates pi G'' amplitude^2."""
    settings = {"omega": 0.5, "amplitude": 1e-5, "cycles": 4, "rows": 4, "tolerance": 1e-3, "solver": 1e-6}
    rows, text = flow(tmp_path, packing, "in.sp.oscillate", **settings)
    assert rows["time"] == pytest.approx(4 * np.pi * np.arange(5), rel=1e-5)
    assert rows["rate"] == pytest.approx(5e-6, rel=1e-4)
    loss = jamlab.complex_modulus(packing, [0.5]).loss[0]
    assert number("dissipated", text) == pytest.approx(4 * np.pi * loss * 1e-10, rel=0.02)


def test_creep(tmp_path, packing):
    """The stress stays; it is viscous first and elastic in the end, when strain is stress over G_0."""
    rows, _ = flow(tmp_path, packing, "in.sp.creep", stress=1e-6, duration=1000, rows=10, tolerance=1e-3)
    assert np.ptp(rows["stress"]) < 1e-9
    assert rows["viscous_stress"][0] == pytest.approx(1e-6, rel=1e-4)
    assert 1e-6 / rows["strain"][-1] == pytest.approx(jamlab.complex_modulus(packing, [1.0]).g0, rel=2e-3)


@pytest.mark.parametrize("damping", ["stokes", pytest.param("contact", marks=pytest.mark.slow)])
def test_startup_of_droplets(tmp_path, damping):
    """Over a flip of the box: energy is that of the state written; the fluid's stress is all of the viscous one of
    Stokes drag, and that of contacts begins near zero."""
    droplets = jamlab.read("tests/states/stable_droplets.h5")
    eta_f = 0.5 if damping == "stokes" else 0.0
    rows, text = flow(tmp_path, droplets, "in.dp.startup", rate=0.1, strain=0.6, rows=3, damping=damping, eta_f=eta_f)
    assert rows["strain"] == pytest.approx([0, 0.2, 0.4, 0.6], abs=1e-6)
    if damping == "stokes":
        assert rows["viscous_stress"] == pytest.approx(0.05)
    else:
        assert abs(rows["viscous_stress"][0]) < 1e-4 < rows["viscous_stress"][-1]
    assert rows["stress"] == pytest.approx(rows["elastic_stress"] + rows["viscous_stress"], rel=1e-3)
    assert number("work", text) == pytest.approx(number("dissipated", text) + np.diff(rows["energy"]).sum(), rel=0.02)
    state = jamlab.read(tmp_path / "dp.flow.data")
    assert state.box[1, 0] < 0.5 * state.box[0, 0] and state.params["ka"] == droplets.params["ka"]
    assert jamlab.evaluate(state).energy / state.area == pytest.approx(rows["energy"][-1], rel=1e-3)


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
    for deck in [*FIRST, *sorted(set(DECKS) - set(FIRST))]:
        (example,) = re.findall(rf"^#   (.*lmp -in {re.escape(deck)}.*)$", (folder / deck).read_text(), re.MULTILINE)
        line = [str(deck_runs.LMP.parent / word) if word in ("lmp", "mpiexec") else word
                for word in example.replace(*SHORTER.get(deck, ("", ""))).split()]  # fmt: skip
        done = subprocess.run(line, cwd=folder, capture_output=True, text=True, timeout=600, check=False)
        assert done.returncode in (0, 2 if ".dp." in deck else 0), (example, done.stdout[-2000:])
