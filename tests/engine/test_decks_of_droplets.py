"""Decks of deformable polygons give what the Python engine gives; decks in time of disks and droplets, in plain lmp."""

import re
from pathlib import Path

import numpy as np
import pytest
from deck_runs import frame, number, run

import jamlab
from jamlab.engine.deck_defaults import defaults
from jamlab.packing.lammps_files import described
from jamlab.protocols.random_start import droplet_cell, droplet_params, place_droplets


def test_dp_jams_and_shears(tmp_path):
    """in.dp.jam jams bonded vertex molecules with FIRE; in.dp.shear reads its data file with the rest areas."""
    quick = {"steps": 20000, "step": 0.02, "force": 1e-4, "u_contact": 1e-6, "u_jammed": 1e-4}
    text = run("in.dp.jam", tmp_path, n=6, seed=1, to=0.87, **quick)
    assert 0.75 < number("phi_J", text) < 0.9
    assert 1.01 < number("shape factor", text) < 1.05
    assert len(text.splitlines()) < 40
    assert "d_a0" in (tmp_path / "dp.onset.data").read_text()
    assert "dp.onset.data says converged=0: a force of" in text
    assert not jamlab.read(tmp_path / "dp.onset.data").converged
    assert "modulus G_xy" in run("in.dp.shear", tmp_path, phi_target=0, gamma=0.4, steps=20000)
    text = run("in.dp.shear", tmp_path, code=1, phi_target=0, gamma=0.6)
    assert "REFUSED: gamma = 0.6, but dp.onset.data was made with gamma = 0.4" in text
    text = run("in.dp.shear", tmp_path, code=2, phi_target=0.9, steps=100)
    assert "\nNOT CONVERGED" in text and "modulus" not in text
    assert run("in.dp.shear", tmp_path, code=1, nv_small=17).count("the rest areas in dp.onset.data are not those") == 1
    assert frame(tmp_path / "dp.dump")["radius"] == [0.125] * 87


def test_dp_shear_deck_follows_the_python_engine(tmp_path):
    """Stress of one DP packing under shear: plain lmp from a jamlab data file against the Python engine."""
    *_, packing = jamlab.compress(jamlab.jam("dp", 8, 3), 0.9, 0.1)
    jamlab.write_data(tmp_path / "packing.data", packing)
    law = {"data": "packing.data", "phi_target": 0}
    assert "converged=0: a force" in run("in.dp.shear", tmp_path, code=2, **law, strain=1e-4, force=1e-8)
    text = run("in.dp.shear", tmp_path, **law, strain=1e-5)
    assert jamlab.read(tmp_path / "dp.sheared.data").converged
    exact, error = jamlab.shear_modulus(packing), number("error", text)
    assert abs(number("modulus G_xy", text) - exact) <= error < 0.1 * exact
    text = run("in.dp.shear", tmp_path, code=2, **law, strain=1e-9, force=1e-7)
    assert "\nNO MODULUS: forces up to 1e-07 leave G_xy" in text and "relaxed shear modulus" not in text


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


COLUMNS = ("time strain rate stress elastic viscous pressure n1 dissipation energy iterations").split()


@pytest.fixture(scope="module")
def packing():
    return jamlab.pack(n=32, pressure=1e-2, seed=3)


def table(text):
    """Columns of the table by name."""
    lines = re.findall(r"^ *((?:[-+.e\d]+ *){11})$", text.rpartition("iterations\n")[2], re.MULTILINE)
    return dict(zip(COLUMNS, np.array([line.split() for line in lines], dtype=float).T, strict=True))


def test_startup(tmp_path, packing):
    """Stress from eta_inf on, to a packing past a flip of its box, which Python reads with the same energy."""
    jamlab.write_data(tmp_path / "packing.data", packing)
    text = run("in.sp.startup", tmp_path, data="packing.data", rate=0.1, strain=0.7, rows=7, beta=0.5)
    rows = table(text)
    assert rows["strain"] == pytest.approx(np.linspace(0, 0.7, 8), abs=1e-6)
    limit = jamlab.complex_modulus(packing, [1.0], jamlab.ContactDamping(beta=0.5)).eta_inf
    assert rows["viscous"][0] == pytest.approx(0.1 * limit, rel=1e-3)
    assert rows["stress"] == pytest.approx(rows["elastic"] + rows["viscous"], rel=1e-3)
    stored = rows["energy"][-1] - rows["energy"][0]
    assert number("work", text) == pytest.approx(number("dissipated", text) + stored, rel=0.02)

    state = jamlab.read(tmp_path / "sp.startup.data")
    assert state.converged is False and abs(state.box[1, 0]) < 0.56 * state.box[0, 0]
    found = jamlab.evaluate(state)
    assert found.energy / state.area == pytest.approx(rows["energy"][-1], rel=1e-5)
    assert -found.stress[0, 1] == pytest.approx(rows["elastic"][-1], rel=1e-4)


def test_oscillate(tmp_path, packing):
    """Strain over strain rate is as asked for; a cycle dissipates pi G'' amplitude^2."""
    jamlab.write_data(tmp_path / "packing.data", packing)
    settings = {"omega": 0.5, "amplitude": 1e-5, "cycles": 4, "rows": 4, "accuracy": 1e-3, "solver": 1e-6}
    text = run("in.sp.oscillate", tmp_path, data="packing.data", **settings)
    rows = table(text)
    assert rows["time"] == pytest.approx(4 * np.pi * np.arange(5), rel=1e-5)
    assert rows["rate"] == pytest.approx(5e-6, rel=1e-4)
    loss = jamlab.complex_modulus(packing, [0.5]).loss[0]
    assert number("dissipated", text) == pytest.approx(4 * np.pi * loss * 1e-10, rel=0.02)


def test_creep(tmp_path, packing):
    """The stress stays; it is viscous first and elastic in the end, when strain is stress over G_0."""
    jamlab.write_data(tmp_path / "packing.data", packing)
    rows = table(run("in.sp.creep", tmp_path, data="packing.data", stress=1e-6, duration=1000, rows=10, accuracy=1e-3))
    assert np.ptp(rows["stress"]) < 1e-9
    assert rows["viscous"][0] == pytest.approx(1e-6, rel=1e-4)
    assert 1e-6 / rows["strain"][-1] == pytest.approx(jamlab.complex_modulus(packing, [1.0]).g0, rel=2e-3)


def test_startup_of_droplets(tmp_path):
    """Stokes drag over a flip: the fluid's stress is all of the viscous one; energy is that of the state written."""
    droplets = jamlab.read(Path(__file__).parents[1] / "states" / "stable_droplets.h5")
    jamlab.write_data(tmp_path / "packing.data", droplets)
    settings = {"rate": 0.1, "strain": 0.6, "rows": 3, "viscous": "stokes", "fluid": 0.5}
    rows = table(text := run("in.dp.startup", tmp_path, data="packing.data", **settings))
    assert rows["strain"] == pytest.approx([0, 0.2, 0.4, 0.6], abs=1e-6)
    assert rows["viscous"] == pytest.approx(0.05) and np.all(rows["dissipation"][1:] > 0)
    stored = rows["energy"][-1] - rows["energy"][0]
    assert number("work", text) == pytest.approx(number("dissipated", text) + stored, rel=0.02)
    state = jamlab.read(tmp_path / "dp.startup.data")
    assert state.box[1, 0] < 0.5 * state.box[0, 0] and state.params["ka"] == droplets.params["ka"]
    assert jamlab.evaluate(state).energy / state.area == pytest.approx(rows["energy"][-1], rel=1e-3)


@pytest.mark.slow
def test_startup_of_droplets_with_contact_drag(tmp_path):
    """Stress begins without a viscous part but for the background's; both add up."""
    droplets = jamlab.read(Path(__file__).parents[1] / "states" / "stable_droplets.h5")
    jamlab.write_data(tmp_path / "packing.data", droplets)
    rows = table(run("in.dp.startup", tmp_path, data="packing.data", rate=0.1, strain=0.4, rows=4))
    assert abs(rows["viscous"][0]) < 1e-4 < rows["viscous"][-1]
    assert rows["stress"] == pytest.approx(rows["elastic"] + rows["viscous"], rel=1e-3)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("alpha", 0.3, "alpha = 0.3: must be >= 0.4, <= 1"),
        ("beta", 1e6, "beta = 1000000.0: must be >= 0, <= 1e5"),
        ("rate", 0, "rate = 0: must be >= 1e-12, <= 1e3"),
        ("arms", "long", "arms = long: must be one of radius | contact"),
        ("force", 1, "-var force: this deck has no such variable"),
    ],
)
def test_refused_before_anything_runs(tmp_path, packing, name, value, message):
    jamlab.write_data(tmp_path / "packing.data", packing)
    assert f"REFUSED: {message}" in run("in.sp.startup", tmp_path, code=1, data="packing.data", **{name: value})
