"""The decks run in plain lmp and give what the Python engine gives."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import jamlab
from jamlab.parameters import defaults, installed

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


def test_dp_jams_and_shears(tmp_path):
    """in.dp.jam jams bonded vertex molecules with FIRE; in.dp.shear reads its data file with the rest areas."""
    text = run("in.dp.jam", tmp_path, n=8, seed=1, to=0.86, steps=20000, step=0.02)
    assert 0.75 < number("phi_J", text) < 0.9
    assert 1.01 < number("shape factor", text) < 1.05
    assert "d_a0" in (tmp_path / "dp.onset.data").read_text()
    assert "modulus G" in run("in.dp.shear", tmp_path, phi_target=0.87, steps=5000)


def test_dp_shear_deck_follows_the_python_engine(tmp_path):
    """Stress of one DP packing under shear: plain lmp from a jamlab data file against the Python engine."""
    *_, packing = jamlab.compress(jamlab.jam("dp", 8, 2), 0.9, 0.1)
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
