"""Decks of deformable polygons run in plain lmp and give what the Python engine gives."""

import numpy as np
from deck_runs import frame, number, run

import jamlab
from jamlab.engine.deck_defaults import defaults
from jamlab.packing.lammps_files import described
from jamlab.protocols.random_start import droplet_cell, droplet_params, place_droplets


def test_dp_jams_and_shears(tmp_path):
    """in.dp.jam jams bonded vertex molecules with FIRE; in.dp.shear reads its data file with the rest areas."""
    text = run(
        "in.dp.jam", tmp_path, n=6, seed=1, to=0.87, steps=20000, step=0.02, force=1e-4, u_contact=1e-6, u_jammed=1e-4
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
