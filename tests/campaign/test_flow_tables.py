"""Flow as an observable of a campaign: tables, means over packings, and what its file refuses."""

from dataclasses import replace

import numpy as np
import pytest
from campaigns import run_here, written

import jamlab
from jamlab.campaign import flow_observables

FLOW = {"rates": [0.5, 1.0], "strain": 1.0, "discard": 0.1, "background_drag": 1e-2}
SWEEP = {
    **{"n": 16, "seeds": 2, "compress": None, "pressures": [2e-2], "observables": ["flow"], "flow": FLOW},
    "damping": {"contact": [1.0], "stokes": [0.5]},
}


def test_means_over_packings(tmp_path):
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml", **SWEEP))
    assert [outcome[0] for outcome in run_here(campaign)] == ["finished"] * 2
    table = campaign.table("flow")
    assert len(table) == 2 * 2 * 2 and set(table["damping"]) == {"contact", "stokes"}  # seeds, laws, rates
    row = table.query("damping == 'contact' and seed == 1 and rate == 0.5").iloc[0]
    packing = jamlab.pack(n=16, pressure=2e-2, seed=1)
    curve = jamlab.flow_curve(packing, [0.5], strain=1.0, discard=0.1, background_drag=1e-2)
    assert row["stress"] == pytest.approx(curve.stress[0], rel=0.05)
    assert row["z_all"] == pytest.approx(curve.z_all[0], rel=0.05) and row["z_all_stderr"] > 0
    means = campaign.aggregate(["stress", "flow_pressure"], by=["damping", "rate"], table="flow", converged=False)
    contact = table.query("damping == 'contact' and rate == 1.0")["stress"]
    found = means.query("damping == 'contact' and rate == 1.0").iloc[0]
    assert found["stress"] == pytest.approx(contact.mean()) and found["stress_packings"] == 2
    with pytest.raises(jamlab.InputError, match="damping = contact, stokes"):
        jamlab.mean_flow_curve(campaign)
    curve = jamlab.mean_flow_curve(table.assign(converged=True), select={"damping": "contact"})
    assert curve.stress[1] == pytest.approx(contact.mean()) and curve.unit == "k"
    assert curve.stress_stderr[1] == pytest.approx(contact.std() / 2**0.5)
    stokes = means.query("damping == 'stokes'").sort_values("rate")["stress"].to_numpy()
    assert np.all(stokes > 0.5 * np.array([0.5, 1.0]))


def test_quasistatic_shear_has_no_drag(tmp_path):
    """One row for each state, whatever drag laws there are; means are those of the run."""
    shear = {"strain": 1.0, "discard": 0.1, "strain_step": 0.05, "force_tolerance": 1e-11}
    changes = {"flow": None, "observables": ["quasistatic_shear"], "quasistatic_shear": shear, "damping": None}
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml", **SWEEP | changes | {"seeds": 1}))
    assert [outcome[0] for outcome in run_here(campaign)] == ["finished"]
    (row,) = campaign.table("quasistatic_shear").to_dict("records")
    run = jamlab.quasistatic_shear(jamlab.pack(n=16, pressure=2e-2, seed=1), 1.1, 0.05, force_tolerance=1e-11)
    assert row["stress"] == pytest.approx(run.steady(discard=0.1).stress, rel=0.1) and row["stress_stderr"] > 0
    assert row["mu"] == pytest.approx(row["stress"] / row["flow_pressure"]) and row["mu_stderr"] > 0
    mean = campaign.aggregate(["mu"], table="quasistatic_shear", converged=False)
    assert mean["mu"].tolist() == [row["mu"]] and mean["mu_packings"].tolist() == [1]
    assert not {"rate", "damping", "tolerance", "background_drag"} & row.keys()


def test_cyclic_shear(tmp_path):
    """A row for each state and amplitude, with what the run says."""
    shear = {"amplitudes": [0.01, 1e-3], "strain_step": 1e-3, "cycles": 8}
    changes = {"flow": None, "observables": ["cyclic_shear"], "cyclic_shear": shear}
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml", **SWEEP | changes | {"damping": None, "seeds": 1}))
    assert [outcome[0] for outcome in run_here(campaign)] == ["finished"]
    small, large = campaign.table("cyclic_shear").to_dict("records")
    assert (small["amplitude"], small["period"], small["cycles_before"], small["plastic_events"]) == (1e-3, 1, 0, 0)
    run = jamlab.quasistatic_shear(jamlab.pack(n=16, pressure=2e-2, seed=1), [0.01, -0.01, 0.01], 1e-3, cycles=8)
    assert (large["period"], large["cycles_before"]) == (run.period, run.limit_cycle.cycles_before)
    assert large["displacement"] == pytest.approx(run.cycles.displacement[-1], abs=1e-9) and large["converged"]
    assert large["dissipated"] == pytest.approx(run.limit_cycle.dissipated / run.period, abs=1e-9)
    assert not {"damping", "background_drag"} & large.keys()


def test_flow_from_quenches_below_and_above_onset(tmp_path):
    """States at packing fractions, in units "k"; the loose one bears no pressure at rest, and flows under little."""
    changes = {"pressures": None, "phi": [0.9, 0.7], "seeds": 1, "damping": {"contact": [1.0]}}
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml", **SWEEP | changes))
    assert [outcome[0] for outcome in run_here(campaign)] == ["finished"]
    states = campaign.table("states")
    assert states["phi"].to_numpy() == pytest.approx([0.7, 0.9]) and set(states["units"]) == {"k"}
    assert states["pressure"].iloc[0] < 1e-9 < 1e-3 < states["pressure"].iloc[1]
    stress = campaign.table("flow").query("rate == 0.5").set_index("state")["stress"]
    assert 0 < stress[0] < 0.5 * stress[1]
    assert campaign.table("onset").empty


def test_oscillation(tmp_path):
    """Each row is what the function gives, beside the linear answer."""
    oscillation = {"omega": [1.0], "amplitudes": [1e-6, 0.1], "cycles": 3}
    changes = {"flow": None, "observables": ["oscillation"], "oscillation": oscillation}
    changes |= {"seeds": 1, "damping": {"contact": [1.0]}}
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml", **SWEEP | changes))
    assert [outcome[0] for outcome in run_here(campaign)] == ["finished"]
    packing = jamlab.pack(n=16, pressure=2e-2, seed=1)
    small, large = campaign.table("oscillation").to_dict("records")
    assert small["storage"] == pytest.approx(jamlab.oscillate(packing, 1.0, 1e-6, cycles=3).storage, rel=1e-9)
    assert small["equivalent_loss"] == pytest.approx(jamlab.complex_modulus(packing, [1.0]).loss[0], rel=1e-9)
    assert small["loss"] == pytest.approx(small["equivalent_loss"], rel=5e-3)
    assert small["equivalent_time"] == pytest.approx(1.0)
    assert large["storage"] < 0.9 * small["storage"] and small["phi"] == pytest.approx(packing.phi)


def test_creep(tmp_path):
    """Under a small stress packings come to rest at the strain stress/G, under a large one they flow; loose ones have
    no answer."""
    creep = {"stresses": [2e-2, 1e-7], "duration": 300.0, "largest_strain": 1.0, "background_drag": 1e-2}
    changes = {"flow": None, "observables": ["creep"], "creep": creep, "seeds": 1, "pressures": None, "phi": [0.6, 0.9]}
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml", **SWEEP | changes))
    assert [outcome[0] for outcome in run_here(campaign)] == ["finished"]
    table = campaign.table("creep")
    assert len(table) == 2 * 2 * 2 and not table.query("state == 0 and damping == 'contact'")["converged"].any()
    _, jammed = campaign.packings(campaign.finished()[0])
    for law in ("contact", "stokes"):
        small, large = table[(table["state"] == 1) & (table["damping"] == law)].to_dict("records")
        assert small["rests"] == 1 == large["flows"] and small["flows"] == 0 == large["rests"]
        assert small["final_strain"] * jamlab.shear_modulus(jammed, direction="simple") == pytest.approx(1e-7, rel=1e-3)
        assert large["final_strain"] > 1 and large["final_time"] < 300 and small["final_time"] == pytest.approx(300)
        assert small["residual_stress"] == large["residual_stress"] and small["ambiguous_contacts"] == 0
    for law, background in ((jamlab.ContactDamping(), 1e-2), (jamlab.StokesDrag(0.5), 0.0)):
        run = jamlab.creep(jammed, 2e-2, 300.0, law, largest_strain=1.0, background_drag=background)
        name = "contact" if background else "stokes"
        same = table[(table["state"] == 1) & (table["damping"] == name) & (table["stress"] == 2e-2)].iloc[0]
        assert (same["final_rate"], same["slope"]) == (run.final_rate, run.slope)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"creep": None}, "creep"),
        ({"damping": {"stokes": [0.0]}}, "eta_f = 0"),
        ({"creep": {"stresses": [1e-3]}}, "duration"),
        ({"creep": {"stresses": [0.0], "duration": 1.0}}, "stresses"),
        ({"creep": {"stresses": [1e-3], "duration": 1.0, "alpha": 0.5}, "damping": {"stokes": [1.0]}}, "alpha"),
    ],
)
def test_creep_that_cannot_be_is_refused(tmp_path, changes, words):
    creep = {"observables": ["creep"], "flow": None, "creep": {"stresses": [1e-3], "duration": 1.0}}
    with pytest.raises(jamlab.InputError, match=words):
        jamlab.open_campaign(written(tmp_path / "c.toml", **SWEEP | creep | changes))


def test_contact_changes_that_did_not_settle_are_counted(tmp_path, monkeypatch):
    """In every table of flow."""
    for name in ("shear", "oscillate", "creep"):
        drive = getattr(jamlab, name)
        monkeypatch.setattr(
            flow_observables, name, lambda *a, drive=drive, **k: replace(drive(*a, **k), ambiguous_contacts=7)
        )
    oscillation = {"omega": [1.0], "amplitudes": [1e-3], "cycles": 2}
    creep = {"stresses": [1e-4], "duration": 1.0}
    changes = {"observables": ["flow", "oscillation", "creep"], "oscillation": oscillation, "creep": creep, "seeds": 1}
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml", **SWEEP | changes))
    assert [outcome[0] for outcome in run_here(campaign)] == ["finished"]
    for name in ("flow", "oscillation", "creep"):
        assert set(campaign.table(name)["ambiguous_contacts"]) == {7.0}
    equivalent = campaign.table("oscillation").set_index("damping")["equivalent_storage"]
    assert np.isfinite(equivalent["contact"]) and np.isnan(equivalent["stokes"])  # known of contact damping alone
