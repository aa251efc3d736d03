"""Figures beyond the papers from tables in which known laws hold, and what becomes of a campaign's tables for them."""

from itertools import product

import beyond_tables
import numpy as np
import pandas as pd
import pytest
from drawn_figures import drawn

import jamlab
from jamlab.geometry.voids.voids import PLATEAU_BORDER
from studies.beyond import couette, polydispersity
from studies.beyond.droplet_modes import group_share
from studies.beyond.droplet_voids import three_disks
from studies.ensemble_tables import EnsembleTables, modes_at_fractions
from studies.speed_accuracy.size_scaling import PARTS, STUDY

LAW = {"gamma": 0.4, "eps": 1.0, "nv_small": 12, "model": "dp", "n": 8, "seed": 1}
SWEEP = pd.DataFrame({"task": "t", "state": [0, 1], "rho": [0.85, 0.87], "phi": [0.86, 0.88], "converged": True, **LAW})
DRAG = {"damping": "stokes", "beta": np.nan, "eta_f": 1.0}


def kept(name, number):
    """A number of a figure, within its interval."""
    found = drawn(f"beyond-droplet-{name}").values[number]
    assert found.low <= found.value <= found.high
    return float(found.value)


def test_figures_keep_what_the_tables_hold():
    for law, part in product(("contact", "Stokes"), ("slow", "middle")):
        share = beyond_tables.RIGID if part == "slow" else beyond_tables.ROUND
        assert kept("modes", f"{law} drag, {part}, whole droplets, rho = 0.86") == pytest.approx(share)
    assert kept("modes", "contact drag, slow, dissipation by sliding") == pytest.approx(1.0)
    assert kept("modes", "slow, exponent of its rate in line tension") == pytest.approx(1.0, abs=0.02)
    assert kept("modes", "middle, exponent of its rate in line tension") == pytest.approx(0.0, abs=1e-6)


def test_overlap_of_three_disks_takes_the_shape_of_the_void_down():
    """By hand: 3.16 for an overlap of a hundredth of the diameter; at contact the Plateau border."""
    overlap, shape = three_disks([1e-9, 1e-3, 1e-2, 2e-2])
    assert shape == pytest.approx([PLATEAU_BORDER, 4.16, 3.16, 2.76], abs=5e-3)
    assert overlap[0] == pytest.approx(0, abs=1e-12) and np.all(np.diff(overlap) > 0)
    panel = drawn("beyond-droplet-voids").table.query("panel == 'b'")
    own = panel[panel["series"].str.startswith("12, 17")]
    line = panel[panel["series"] == "three equal disks"]
    inside = own["x"].between(line["x"].min(), line["x"].max())
    assert np.interp(own["x"][inside], line["x"], line["y"]) == pytest.approx(own["y"][inside].to_numpy(), rel=0.2)


def test_modes_are_binned_without_loss():
    """Strength and its parts are kept, also of rates beyond the bins; between states they are interpolated."""
    shares = {"translation": 0.4, "rotation": 0.1, "along": 0.3, "across": 0.2, "sliding": 1.0}
    rows = pd.DataFrame(
        [
            {"task": "t", "state": k, **DRAG, "rates": rate, "strengths": strength, **shares}
            for k, strength in ((0, 1.0), (1, 3.0))
            for rate in (1e-9, 1.1e-3, 1.2e-3, 1e9)
        ]
    )
    found = modes_at_fractions(SWEEP, rows)
    assert found["strength"].sum() == pytest.approx(4 * 2.0) and len(found) == 3
    assert found["translation"].sum() == pytest.approx(4 * 2.0 * 0.4)
    assert group_share(found, (0.0, 1.0), ("translation", "rotation")).value == pytest.approx(0.5)


# studies that are measured -------------------------------------------------------------------------------------------


def test_rows_of_the_couette_cell_are_those_of_a_run(monkeypatch):
    for name, value in {"PARTICLES": 64, "STRAIN": 0.02, "KEPT": 0.01}.items():
        monkeypatch.setattr(couette, name, value)
    still, flowing = (couette.measure_profile(rate, 1) for rate in (0.0, 0.3))
    walled = jamlab.with_walls(jamlab.pack(64, couette.PRESSURE, 1))
    run = jamlab.quasistatic_shear(walled, 0.02, couette.STEP, snapshot_every=0.01)
    assert still[0]["lower"] == pytest.approx(run.wall_stress[1:, 0, 0].mean())
    for rows in (still, flowing):
        assert len(rows) == len(couette.PLACES) and rows[0]["lower"] == pytest.approx(rows[0]["upper"], rel=1e-2)


def test_rows_are_measured_at_one_distance_above_the_onset_of_each_packing(monkeypatch):
    monkeypatch.setattr(polydispersity, "PARTICLES", {"sp": 8, "dp": 4})
    monkeypatch.setattr(polydispersity, "BLOCK", 1)
    (row,) = polydispersity.measure_sizes("sp", "lognormal:0.2", 3)
    onset = jamlab.jam(n=8, seed=3, sizes="lognormal:0.2")
    *_, state = jamlab.compress(onset, onset.phi + polydispersity.DISTANCE, polydispersity.DISTANCE / 4, by="phi")
    assert row["phi_J"] == onset.phi and row["z"] == jamlab.contacts(state).z
    assert row["g"] == pytest.approx(jamlab.shear_modulus(state), rel=1e-9)
    assert row["storage_0.1"] == pytest.approx(jamlab.complex_modulus(state, [0.1]).storage[0], rel=1e-9)


def test_the_power_of_made_up_costs_is_found():
    rows = [{"part": "disks: contacts", "n": n, "seconds": 2e-6 * n**1.5, "bytes": 10**8} for n in (64, 256, 1024)]
    (table,) = STUDY.draw(EnsembleTables(lambda name: pd.DataFrame(rows))).text
    assert table.rows[0][2] == "1.50" and {task.partition(", N")[0] for task in STUDY.tasks} == set(PARTS)
