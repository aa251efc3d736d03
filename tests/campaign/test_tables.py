"""Campaigns: tables, what they hold, means with intervals."""

import numpy as np
import pandas as pd
import pytest
from campaigns import run_here, written

import jamlab
from jamlab.campaign import states
from jamlab.campaign.observables import TABLES, SpectraOfStates
from jamlab.campaign.tables import TABLE_COLUMNS, TableParts, aggregate
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import InputError
from jamlab.measure import measure
from jamlab.packing.quantities import COLUMNS
from jamlab.protocols.make import make
from jamlab.storage.table_file import write_table


def test_tables_have_their_columns_and_one_row_for_each(full):
    for name in TABLES:
        assert tuple(full.table(name).columns) == TABLE_COLUMNS[name]
    onset, states = full.table("onset"), full.table("states")
    assert list(onset["model"]) == ["dp", "sp", "sp", "sp", "sp"]
    assert len(states) == sum(len(full.packings(task)) for task in full.finished())
    assert len(full.table("spectra")) == 2 * 2 * 2 * 2  # pressures, laws, pre-stress, frequencies
    assert len(full.table("quasistatic")) == 4
    assert set(full.table("states", sweep="sheared")["n"]) == {32}
    with pytest.raises(InputError):
        full.table("state")


def test_tables_hold_what_jamlab_measures(full):
    states = full.table("states", sweep="up")
    row = states[(states.n == 10) & (states.seed == 4)].iloc[-1]
    p = full.packings(row.task)[-1]
    assert {name: row[name] for name in COLUMNS} == pytest.approx(measure(p), nan_ok=True)
    assert (row.units, row.ensemble, row.contact) == ("eps", "fixed-box", "")
    onset = jamlab.jam(n=10, seed=4)
    assert (row.rho_J, row.phi_J) == (jamlab.packing_fraction(onset), onset.phi)
    first = full.table("onset", sweep="up").query("n == 10 and seed == 4").iloc[0]
    network = jamlab.contacts(onset)
    assert (first.rho_J, first.phi_J, first.z_J) == (row.rho_J, onset.phi, network.z)
    assert first.rattlers == network.rattlers.sum()
    voids = full.table("voids", sweep="up").query("n == 10 and seed == 4")
    v = jamlab.voids(p)
    last = voids[voids.state == row.state]
    assert last.sides.tolist() == v.sides[v.percolating == 0].tolist()
    assert last["area"].sum() == v.area[v.percolating == 0].sum()
    assert last.particle_area.iloc[0] == pytest.approx(row.rho * p.area / p.n)
    droplet = full.table("states", sweep="droplets").iloc[0]
    assert (droplet.gamma, droplet.ka, droplet.contact) == (0.12, defaults("dp")["ka"], "outline")
    assert (droplet.start, set(full.table("states", sweep="sheared")["start"])) == ("direct", {""})


def test_a_campaign_of_sticky_disks_holds_pressures_of_either_sign(tmp_path):
    law, pressures = {"stickiness": 0.05}, [1e-2, -1e-3]
    file = written(tmp_path / "c.toml", n=16, seeds=1, compress=None, pressures=pressures, law=law)
    run_here(campaign := jamlab.open_campaign(file))
    rows = campaign.table("states")
    assert rows["pressure"].to_numpy() == pytest.approx(pressures, rel=1e-6) and rows["converged"].all()
    assert rows["target_pressure"].tolist() == pressures
    packing = campaign.packings(campaign.finished()[0])[0]
    assert (packing.params["stickiness"] == rows["stickiness"]).all() and rows["z"][0] == jamlab.contacts(packing).z


def test_spectra_hold_what_jamlab_computes(full):
    frame = full.table("spectra")
    row = frame[(frame.damping == "stokes") & ~frame.prestress & (frame.target_pressure == 1e-3) & (frame.omega == 1.0)]
    p = next(p for p in full.packings(row.task.iloc[0]) if abs(p.provenance["pressure"] / 1e-3 - 1) < 1e-5)
    s = jamlab.complex_modulus(p, [1e-3, 1.0], jamlab.StokesDrag(eta_f=2.0), prestress=False)
    assert (row.storage.item(), row.loss.item()) == (s.storage[1], s.loss[1])
    assert (row.g0.item(), row.eta0.item(), row.eta_inf.item()) == (s.g0, s.eta0, s.eta_inf)
    assert (row.eta_f.item(), np.isnan(row.beta.item()), row.converged.item()) == (2.0, True, True)
    slow = full.table("quasistatic").query("prestress and target_pressure == 1e-3").iloc[0]
    u = jamlab.nonaffine_response(p)
    assert slow.median_normal == pytest.approx(u.median_normal, rel=1e-9)
    assert slow.median_tangential == pytest.approx(u.median_tangential, rel=1e-9)
    means = [np.abs(u.normal).mean(), np.hypot(*u.nonaffine.T).mean(), np.median(np.abs(u.nonaffine_tangential))]
    found = slow[["mean_normal", "mean_nonaffine", "median_nonaffine_tangential"]].tolist()
    assert found == pytest.approx(means, rel=1e-9)
    c = jamlab.displacement_correlation(p, 1e-2, jamlab.ContactDamping(), prestress=True)
    curve = full.table("correlation").query("damping == 'contact' and prestress and target_pressure == 1e-3")
    assert (curve.delta.tolist(), curve.box.iloc[0]) == (c.delta.tolist(), p.box[0, 0])
    np.testing.assert_allclose(curve.c, c.correlation, atol=1e-9)


def test_what_is_not_converged_is_marked(tmp_path, monkeypatch):
    monkeypatch.setattr(states, "make", lambda recipe: make(recipe).with_state(converged=False))
    alone = {"seeds": 1, "n": 8, "compress": None, "onset": True, "observables": ["voids"]}
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml", **alone))
    assert run_here(campaign)[0][0] == "finished"
    assert campaign.table("states")["converged"].tolist() == [False]
    assert campaign.table("onset")["converged"].tolist() == [False]
    assert campaign.aggregate(["rho"]).empty
    assert len(campaign.table("voids")) and campaign.aggregate(["sides"], table="voids").empty
    assert campaign.aggregate(["sides"], table="voids", converged=False)["packings"].tolist() == [1]


def test_what_missed_its_target_is_marked_in_every_table(tmp_path, monkeypatch):
    monkeypatch.setattr(states, "make", lambda recipe: make(recipe).with_state(on_target=False))
    keys = {"seeds": 1, "n": 16, "compress": None, "pressures": [1e-2], "observables": ["spectra"], "omega": [1.0]}
    run_here(campaign := jamlab.open_campaign(written(tmp_path / "c.toml", **keys)))
    spectra = campaign.table("spectra")
    assert spectra["error_bound"].max() < 1e-3 and campaign.table("states")["converged"].tolist() == [False]
    assert spectra["converged"].tolist() == [False]


def test_spectra_beyond_their_error_are_not_converged(sp_jammed, monkeypatch):
    wanted = {"law": jamlab.ContactDamping(), "prestress": True}
    assert SpectraOfStates(omega=[1.0]).one(sp_jammed, **wanted)[0]["converged"].all()
    monkeypatch.setattr("jamlab.campaign.observables.SPECTRUM_ERROR", -1.0)
    assert not SpectraOfStates(omega=[1.0]).one(sp_jammed, **wanted)[0]["converged"].any()


def test_packings_are_drawn_not_rows():
    """Ten equal rows of a packing tell no more than one."""
    seeds = np.repeat([1, 2, 3], [10, 1, 1])
    frame = pd.DataFrame({"model": "sp", "n": 8, "seed": seeds, "z": [4.0] * 10 + [5.0, 6.0]})
    row = aggregate(frame, ["z"], ["n"]).iloc[0]
    once = aggregate(frame.drop_duplicates(), ["z"], ["n"]).iloc[0]
    assert (row.z, row.z_packings) == (5.0, 3)
    assert (row.z_low, row.z_high) == (once.z_low, once.z_high)


def test_groups_bins_and_what_is_left_out():
    frame = pd.DataFrame({"model": "sp", "n": 8, "seed": [1, 2, 1, 2, 1], "p": [1e-3, 1.0000002e-3, *[1e-2] * 3]})
    frame = frame.assign(x=[0.1, 0.3, 1.5, 1.7, 9.0], g=[1.0, 3.0, 5.0, np.nan, 100.0])
    assert aggregate(frame, ["g"], ["p"])["g_packings"].tolist() == [2, 1]
    binned = aggregate(frame, ["g"], ["n"], along="x", bins=[0, 1, 2])
    assert (binned.g.tolist(), binned.x.tolist()) == ([2.0, 5.0], [0.2, 1.6])
    for wrong in ({"bins": [0, 1]}, {"along": "x"}, {"along": "x", "bins": [2, 1]}, {"confidence": 1.0}):
        with pytest.raises(InputError) as caught:
            aggregate(frame, ["g"], ["p"], **wrong)
        assert str(list(wrong.values())[-1]) in str(caught.value)
    with pytest.raises(InputError) as caught:
        aggregate(frame, ["h"], ["p"])
    assert "'h'" in str(caught.value)


MIXED = [
    ("spectra", ["omega", "damping"], "prestress"),
    ("spectra", ["omega", "prestress"], "damping"),
    ("states", ["target_pressure"], "model"),
    ("states", ["model"], "ensemble"),
]


@pytest.mark.parametrize(("table", "by", "named"), MIXED)
def test_what_differs_is_not_averaged(full, table, by, named):
    """Disks and droplets, either damping law, with and without prestress: the column to add is named."""
    with pytest.raises(InputError) as caught:
        full.aggregate(["omega" if table == "spectra" else "rho"], by=by, table=table)
    assert f"add {named!r} to by=" in str(caught.value)


def test_what_is_alike_is_averaged(full):
    good = full.aggregate(["storage"], by=["target_pressure", "omega", "damping", "prestress"], table="spectra")
    assert len(good) == 16 and set(good["packings"]) == {1}


def test_force_laws_and_sizes_are_not_averaged(tmp_path):
    """One seed gives as many packings as there are laws; columns that differ stand in every table."""
    keys = {"n": 8, "seeds": 2, "compress": None, "phi": [0.9], "observables": ["order"]}
    path = written(tmp_path / "c.toml", **keys)
    first = path.read_text()
    for changes, by in (({"law": {"exponent": 2.5}}, "exponent"), ({"sizes": "lognormal:0.2"}, "sizes")):
        other = written(path, **keys | changes).read_text()
        path.write_text(first + other[other.index("[[sweep]]") :].replace("disks", "others"))
        run_here(campaign := jamlab.open_campaign(path))  # the first sweep is there
        for table, value in (("states", "rho"), ("order", "psi_6")):
            assert by in campaign.table(table) and ("sizes" in campaign.table(table)) == (by == "sizes")
            assert "sizes" not in campaign.table(table, "others") and "units" not in campaign.table("order")
            with pytest.raises(InputError, match=f"'{by}'"):
                campaign.aggregate([value], table=table)
            found = campaign.aggregate([value], by=[by], table=table)
            assert found["packings"].tolist() == [2, 2]
            assert campaign.aggregate([value], table=table, sweep="others")["packings"].tolist() == [2]


@pytest.mark.parametrize(
    ("table", "value", "named"),
    [("spectra", "storage", "omega"), ("states", "z", "target_pressure"), ("correlation", "c", "target_pressure")],
)
def test_what_was_set_is_not_averaged(full, table, value, named):
    """The mean over frequencies or pressures depends on which were chosen."""
    by = [each for each in ("damping", "prestress", "target_pressure") if table != "states" and each != named]
    with pytest.raises(InputError, match=f"values of {named}: add '{named}' to by="):
        full.aggregate([value], by=by, table=table, sweep="sheared")
    assert len(full.aggregate([value], by=[*by, named], table=table, sweep="sheared"))
    assert len(full.aggregate(["rho_J"], by=["n"], sweep="up")) == 2  # the same in all states of a packing


def test_a_mean_warns_of_the_moduli_that_it_is_of(full, recwarn, monkeypatch):
    """Not of those in other columns."""
    rows = TableParts._rows

    def unstable(self, names, negative):
        found = rows(self, names, negative)
        if self._name == "states":
            found["g"] = -1.0
            negative.count({each: found[each] for each in self._warned if each == "g"})
        return found

    monkeypatch.setattr(TableParts, "_rows", unstable)
    full.aggregate(["z"], sweep="up")
    full.aggregate(["sides"], table="voids", sweep="up")
    assert not recwarn.list
    with pytest.warns(jamlab.JamlabWarning, match="g < 0 in"):
        full.aggregate(["z", "g"], sweep="up")


def test_a_table_without_rows_has_a_mean_without_rows(tmp_path):
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml"))
    assert list(campaign.aggregate(["z"], ["n"]).columns) == ["n", "packings", "z", "z_low", "z_high", "z_packings"]


def test_columns_without_numbers_are_named(full):
    for how in ({"values": ["contact"]}, {"values": ["rho"], "along": "units", "bins": [0, 1]}):
        with pytest.raises(InputError) as caught:
            full.aggregate(**how, sweep="up")
        assert "holds no numbers" in str(caught.value)


def test_keys_of_groups_read_back_exactly(tmp_path):
    """A frequency is what it was in every row; pressures that were met to 1e-6 are one, to five digits."""
    omega = np.geomspace(1e-3, 1e2, 4)
    frame = pd.DataFrame({"model": "sp", "n": 8, "seed": [1, 2], "p": [1e-3, 1.0000002e-3]})
    frame = frame.merge(pd.DataFrame({"omega": omega, "g": omega**2}), how="cross")
    means = aggregate(frame, ["g"], ["p", "omega"])
    assert means["omega"].tolist() == omega.tolist() and set(means["p"]) == {1e-3}
    write_table(means, tmp_path / "means.csv")
    read = pd.read_csv(tmp_path / "means.csv", dtype=str)
    assert [float(text) for text in read["omega"]] == omega.tolist()


def test_a_campaign_collapses_as_the_spectra_of_its_packings(tmp_path):
    keys = {"n": 16, "seeds": 2, "compress": None, "pressures": [1e-2, 3e-2, 2e-2], "observables": ["spectra"]}
    keys |= {"omega": np.geomspace(1e-5, 1, 6).tolist(), "prestress": [True, False]}
    run_here(campaign := jamlab.open_campaign(written(tmp_path / "c.toml", **keys)))
    assert repr(campaign).startswith("Campaign('") and repr(campaign).endswith(", sweeps: disks)")
    with pytest.raises(jamlab.InputError, match="sweep is no column: choose by columns in which sweeps differ"):
        jamlab.scaling_collapse(campaign, select={"sweep": "disks"})
    with pytest.raises(jamlab.InputError, match="the table has no column 'omegas': did you mean omega"):
        campaign.aggregate(["storage"], by=["omegas"], table="spectra")
    with pytest.raises(jamlab.InputError, match="select: the table has no column 'omegas': did you mean omega"):
        jamlab.scaling_collapse(campaign, select={"omegas": 1.0})
    with pytest.raises(jamlab.InputError, match=r"such as select=\{'target_pressure': 0\.03\}$"):
        jamlab.density_of_states(campaign)
    assert jamlab.density_of_states(campaign, select={"target_pressure": 0.01}).packings == 2
    found = jamlab.scaling_collapse(campaign, select={"prestress": False}, resamples=3)
    pressures, omega = [1e-2, 2e-2, 3e-2], np.unique(campaign.table("spectra")["omega"])
    packings = [packing for task in campaign.finished() for packing in campaign.packings(task)]
    groups = [[p for p in packings if abs(p.provenance["pressure"] / q - 1) < 1e-3] for q in pressures]
    spectra = [[jamlab.complex_modulus(p, omega, prestress=False) for p in group] for group in groups]
    by_hand = jamlab.scaling_collapse(pressures, spectra, resamples=3)
    assert (found.mu, found.lambda_, found.mu_ci95) == (by_hand.mu, by_hand.lambda_, by_hand.mu_ci95)
    assert found.unit == by_hand.unit and np.array_equal(found.loss, by_hand.loss)
    means = jamlab.mean_spectra(campaign, select={"prestress": False})
    assert np.array_equal(np.array([mean.loss[:-1] for mean in means]), by_hand.loss)  # below omega = 0.1
    assert (means[0].units, means.damping) == ("k", jamlab.ContactDamping())
