"""The decks run in plain lmp and give what the Python engine gives."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import jamlab
from jamlab.engine.deck_defaults import defaults, installed

LMP = Path(sys.executable).parent / "lmp"


def run(deck: str, folder: Path, **variables: object) -> str:
    settings = [word for name, value in variables.items() for word in ("-var", name, str(value))]
    inputs = installed("lammps_inputs")
    command = [str(LMP), "-in", str(inputs / deck), "-var", "dir", str(inputs), *settings, "-log", "none"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout[-2000:]
    return done.stdout


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
    protocol = defaults("protocol")
    assert float(protocol["u_contact"]) <= number("with u", text) <= float(protocol["u_jammed"])
    assert number("fmax", text) <= 1e-12
    assert (tmp_path / "sp.dump").read_text().count("ITEM: TIMESTEP") >= 2
    sheared = run("in.sp.shear", tmp_path, phi_target=0.95)
    assert np.isfinite(number("modulus G", sheared))


def test_sp_shear_deck_gives_the_modulus_of_linear_response(tmp_path):
    """One packing through jamlab.write_data and plain lmp: the same G as by the analytic Hessian."""
    *_, packing = jamlab.compress(jamlab.jam("sp", 32, 2), 0.93, 0.05, by="phi")
    jamlab.write_data(tmp_path / "packing.data", packing)
    text = run("in.sp.shear", tmp_path, data="packing.data", phi_target=0, strain=1e-7)
    assert number("modulus G", text) == pytest.approx(jamlab.shear_modulus(packing), rel=1e-3)


@pytest.fixture(scope="module")
def dense():
    """A packing of disks in which every contact bears load: none opens or closes at small strain."""
    *_, packing = jamlab.compress(jamlab.jam("sp", 32, 2), 0.93, 0.05, by="phi")
    return packing


def test_sp_shear_deck_takes_several_steps(tmp_path, dense):
    jamlab.write_data(tmp_path / "packing.data", dense)
    text = run("in.sp.shear", tmp_path, data="packing.data", phi_target=0, strain=1e-7, steps_shear=3)
    gamma = [float(g) for g in re.findall(r"^gamma (\S+)", text, re.MULTILINE)]
    assert gamma == pytest.approx([0, 1e-7, 2e-7, 3e-7], rel=1e-5)
    assert number("modulus G", text) == pytest.approx(jamlab.shear_modulus(dense), rel=1e-3)


@pytest.mark.parametrize(("to", "nearest"), [(0.9, 1e-4), (0.96, None)])
def test_sp_compress_deck_goes_through_the_states_of_python(tmp_path, dense, to, nearest):
    """Down by log-spaced steps, up by equal ones."""
    states = list(jamlab.compress(dense, to, 0.01, by="phi", nearest=nearest))
    jamlab.write_data(tmp_path / "packing.data", dense)
    text = run("in.sp.compress", tmp_path, data="packing.data", to=to, nearest=nearest or 0, above=0.01)
    found = np.array(re.findall(r"^phi (\S+) u (\S+) pressure (\S+) fmax (\S+)", text, re.MULTILINE), dtype=float)
    evaluated = [jamlab.evaluate(state) for state in states]
    assert found[:, 0] == pytest.approx([state.phi for state in states], abs=1e-9)
    assert found[:, 1] == pytest.approx([e.energy / dense.n for e in evaluated], rel=1e-8)
    assert found[:, 2] == pytest.approx([e.pressure for e in evaluated], rel=1e-8)
    assert found[:, 3].max() <= 1e-12
    assert (tmp_path / "sp.dump").read_text().count("ITEM: TIMESTEP") == 1 + len(states)
    last = disks(tmp_path / "sp.compressed.data", dense)
    assert jamlab.evaluate(last).pressure == pytest.approx(found[-1, 2], rel=1e-9)


def test_decks_say_when_a_minimum_was_not_reached(tmp_path, dense):
    jamlab.write_data(tmp_path / "packing.data", dense)
    settings = {"data": "packing.data", "to": 0.94, "nearest": 0}
    assert "NOT CONVERGED: fmax is above" not in run("in.sp.compress", tmp_path, **settings)
    assert "\nNOT CONVERGED: fmax is above" in run("in.sp.compress", tmp_path, **settings, steps=3)


@pytest.mark.parametrize("pressure", [3e-2, 1e-4])
def test_sp_pressure_deck_meets_the_pressure(tmp_path, pressure):
    text = run("in.sp.pressure", tmp_path, n=32, seed=3, pressure=pressure)
    assert "\nNOT" not in text
    state = jamlab.evaluate(disks(tmp_path / "sp.pressure.data", units="k"))
    assert state.pressure == pytest.approx(pressure, rel=1e-6)
    assert state.max_force < 2e-12
    assert "\nNOT MET" in run("in.sp.pressure", tmp_path, n=32, seed=3, pressure=pressure, tries=2)


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
    assert "\nUNJAMMED" in run("in.sp.stabilize", tmp_path, data="packing.data", law="k")


def test_sp_bulk_deck_halves_the_strain_until_no_contact_changes(tmp_path, dense):
    jamlab.write_data(tmp_path / "packing.data", dense)
    text = run("in.sp.bulk", tmp_path, data="packing.data", strain=0.02)
    assert number("strain", text) < 0.02
    assert number("modulus B", text) == pytest.approx(jamlab.bulk_modulus(dense), rel=0.01)


def test_sp_contacts_deck(tmp_path, random_disks):
    """Three sizes in a tilted box, with disks that only rattle once others are taken out."""
    packing = random_disks(tilt=0.3, n=40, phi=0.75)
    network = jamlab.contacts(packing)
    few = np.bincount(network.pairs.ravel(), minlength=packing.n) < 3
    assert 0 < few.sum() < network.rattlers.sum() < packing.n
    sizes = jamlab.write_data(tmp_path / "packing.data", packing).values
    diameters = {f"d{k}": f"{d:.17g}" for k, d in enumerate(sizes, start=1)}
    text = run("in.sp.contacts", tmp_path, data="packing.data", ntypes=len(sizes), nearby=3, **diameters)
    assert number("N_c", text) == network.count
    assert number("backbone", text) == network.backbone
    assert number("rattlers", text) == network.rattlers.sum()
    assert number("isostatic", text) == network.isostatic
    assert number("z", text) == pytest.approx(network.z, abs=1e-14)

    psi = bond_order(packing)
    assert number("psi6 of a disk", text) == pytest.approx(np.abs(psi).mean(), abs=1e-12)
    assert number("of all", text) == pytest.approx(abs(psi.mean()), abs=1e-12)
    columns = np.loadtxt(tmp_path / "sp.contacts.dump", skiprows=9)[:, 5:]
    degree = np.bincount(network.pairs[network.bearing].ravel(), minlength=packing.n)
    assert np.array_equal(columns[~network.rattlers, 0], degree[~network.rattlers])
    assert np.array_equal(columns[:, 1].astype(bool), network.rattlers)
    assert columns[:, 2] == pytest.approx(np.abs(psi), abs=1e-12)


@pytest.mark.parametrize("units", ["eps", "k"])
def test_sp_hessian_deck(tmp_path, random_disks, units):
    """Finite differences of LAMMPS forces against the analytic Hessian, prestress included."""
    packing = random_disks(units=units)
    sizes = jamlab.write_data(tmp_path / "packing.data", packing).values
    law = {"law": units, units: packing.params[units], "ntypes": len(sizes)}
    run(
        "in.sp.hessian",
        tmp_path,
        data="packing.data",
        **law,
        **{f"d{k}": f"{d:.17g}" for k, d in enumerate(sizes, start=1)},
    )
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
    assert "d_a0" in (tmp_path / "dp.onset.data").read_text()
    assert "modulus G" in run("in.dp.shear", tmp_path, phi_target=0.87, steps=5000)


def test_dp_shear_deck_follows_the_python_engine(tmp_path):
    """Stress of one DP packing under shear: plain lmp from a jamlab data file against the Python engine."""
    *_, packing = jamlab.compress(jamlab.jam("dp", 8, 3), 0.9, 0.1)
    jamlab.write_data(tmp_path / "packing.data", packing)
    text = run("in.dp.shear", tmp_path, data="packing.data", phi_target=0, strain=1e-4, force=1e-8)
    assert number("modulus G", text) == pytest.approx(jamlab.shear_modulus(packing), abs=2e-3)


def test_polygon_templates_are_regular_and_of_unit_area():
    for nv in (12, 17):
        lines = (installed("lammps_inputs") / f"polygon{nv}.mol").read_text().splitlines()
        start = lines.index("Coords") + 2
        x = np.array([[float(w) for w in line.split()[1:3]] for line in lines[start : start + nv]])
        y = np.roll(x, -1, axis=0)
        assert 0.5 * np.sum(x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0]) == pytest.approx(1.0, abs=1e-14)
        assert np.ptp(np.hypot(*(y - x).T)) < 1e-14
