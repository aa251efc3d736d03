"""Calibration of the droplets' law, on made-up sweeps whose answer is known."""

import numpy as np
import pandas as pd
import pytest
from campaigns import read_campaign_file

import jamlab
from studies.droplet_calibration import (
    CONFLUENCE,
    DISTANCES,
    FITTED,
    TARGETS,
    campaign_text,
    fit,
    observables,
    open_scan,
    sensitivity,
)
from studies.published_numbers import table_contacts, table_modulus

CENTRE = {"gamma": 0.2, "ka": 100.0, "delta": 0.3}
BEST = {"gamma": 0.3, "ka": 150.0, "delta": 0.25}
SLOPES = {
    "z(0.05)": (0, 0, 0.4),
    "z(0.1)": (0, 0.1, 0.5),
    "G(0.05)": (0.08, 0, 0),
    "G(0.1)": (0.17, 0.02, 0.01),
    "G(0.15)": (0.3, 0, 0.02),
}


def sweep(seeds=(1, 2, 3), z=lambda d: 4 + 10 * d, g=lambda d: 2 * d, converged=True):
    """States at onset and 12 distances up to confluence."""
    rows = []
    for seed in seeds:
        onset = 0.83 + 0.001 * seed
        for state, rho in enumerate(np.linspace(onset, CONFLUENCE, 13)):
            d = rho - onset
            rows.append({"n": 8, "seed": seed, "state": state, "onset": onset, "rho": rho, "z": z(d), "g": g(d)})
            rows[-1] |= {"shape": 1.02 + 0.3 * d, "shape_rim": 1.01 + 0.2 * d, "area": 0.996 - 0.05 * d}
            rows[-1] |= {"converged": converged}
    return pd.DataFrame(rows)


def scan(best=BEST):
    """Observables linear in log2 of the parameters that meet every target at `best`."""
    sets = {"centre": CENTRE}
    for name in FITTED:
        sets |= {f"{name}-{side}": CENTRE | {name: f * CENTRE[name]} for side, f in (("halved", 0.5), ("doubled", 2))}
    tables = {}
    for label, law in sets.items():
        off = np.array([np.log2(law[name] / best[name]) for name in FITTED])
        row = {key: target.value + off @ SLOPES.get(key, (0.01, 0.02, 0.03)) for key, target in TARGETS.items()}
        tables[label] = pd.DataFrame([{"seed": seed, "rho_J": 0.83} | row for seed in (1, 2, 3)])
    return tables


def test_observables_are_read_off_at_fixed_distances():
    found = observables(sweep())
    assert list(found["seed"]) == [1, 2, 3]
    assert found["rho_J"].tolist() == pytest.approx([0.831, 0.832, 0.833])
    for d in DISTANCES["z"]:
        assert found[f"z({d:g})"].tolist() == pytest.approx([4 + 10 * d] * 3)
    for d in DISTANCES["G"]:
        assert found[f"G({d:g})"].tolist() == pytest.approx([2 * d] * 3)
    reach = CONFLUENCE - found["rho_J"]
    assert found["A"].tolist() == pytest.approx((1.02 + 0.3 * reach).tolist())
    assert found["A with rim"].tolist() == pytest.approx((1.01 + 0.2 * reach).tolist())
    assert found["area deficit"].tolist() == pytest.approx((0.05 * reach / 0.996).tolist())


def test_states_that_are_not_stable_or_did_not_converge_are_left_out():
    table = sweep(seeds=(1,))
    table.loc[5, "g"] = np.nan
    assert observables(table)["G(0.1)"][0] == pytest.approx(0.2)
    table.loc[table.index[-1], "converged"] = False
    assert np.isnan(observables(table)["A"][0])


def test_change_is_taken_seed_by_seed():
    """The scatter of the seeds drops out of the change; its error is that of the differences."""
    base = pd.DataFrame({"seed": [1, 2, 3], "rho_J": [0.80, 0.85, 0.83]})
    other = pd.DataFrame({"seed": [3, 1, 2], "rho_J": [0.84, 0.81, 0.86]})
    rows = sensitivity({"centre": base, "delta-halved": other}).set_index(["set", "observable"])
    row = rows.loc[("delta-halved", "rho_J")]
    assert row["change"] == pytest.approx(0.01) and row["change_error"] == pytest.approx(0, abs=1e-15)
    assert row["error"] == pytest.approx(np.std([0.84, 0.81, 0.86], ddof=1) / np.sqrt(3))


def test_fit_finds_the_parameters_that_meet_the_targets():
    found = fit(sensitivity(scan()), CENTRE)
    assert found.law == pytest.approx(BEST, rel=1e-3)
    assert found.misfit < 1e-3 < found.misfit_at_centre and not found.at_edge
    assert found.predicted == pytest.approx({name: target.value for name, target in TARGETS.items()}, abs=1e-3)


def test_fit_stays_within_the_scan_and_says_so():
    found = fit(sensitivity(scan(BEST | {"gamma": 0.9})), CENTRE)
    assert found.law["gamma"] == pytest.approx(0.4) and "gamma" in found.at_edge
    assert all(0.5 * CENTRE[name] <= found.law[name] <= 2 * CENTRE[name] for name in FITTED)


def test_targets_are_those_of_the_tables():
    """Boromand et al. tables 1 and 2, DP, at rho - rho_J = 0.09."""
    assert table_contacts("DP(ρ)", 0.09) == pytest.approx(3.97 + 0.99 + 0.639)
    assert table_modulus("DP(ρ)", 0.09) == pytest.approx(0.021 + 0.153)
    assert TARGETS["z(0.1)"].value == table_contacts("DP(ρ)", 0.1)
    assert TARGETS["G(0.15)"].value == table_modulus("DP(ρ)", 0.15)


def test_campaign_of_the_scan(tmp_path):
    file = tmp_path / "c.toml"
    file.write_text(campaign_text(16, 5, CENTRE))
    sweeps = {s.name: s for s in read_campaign_file(file).sweep}
    assert len(sweeps) == 2 * len(FITTED) + 2
    assert sweeps["centre"].force_law == CENTRE
    assert sweeps["ka-doubled"].force_law == CENTRE | {"ka": 200.0}
    assert sweeps["vertices-doubled"].force_law == CENTRE | {"nv_small": 24, "nv_large": 34}


def test_bad_input():
    with pytest.raises(jamlab.InputError, match="'eta'"):
        campaign_text(8, 2, {"eta": 0.1})
    with pytest.raises(jamlab.InputError, match="centre"):
        sensitivity({"ka-halved": observables(sweep())})
    tables = scan()
    del tables["delta-doubled"]
    with pytest.raises(jamlab.InputError, match="delta-doubled"):
        fit(sensitivity(tables), CENTRE)
    tables = scan()
    tables["ka-halved"]["A"] = np.nan
    with pytest.raises(jamlab.InputError, match="A of sweep 'ka-halved'"):
        fit(sensitivity(tables), CENTRE)


@pytest.mark.parametrize(("n", "seeds", "text"), [(3, 4, "n = 3"), (8, 1, "seeds = 1")])
def test_what_no_scan_can_start_from_writes_nothing(tmp_path, n, seeds, text):
    with pytest.raises(jamlab.InputError, match=text):
        open_scan(tmp_path / "scan", n, seeds)
    assert not list((tmp_path / "scan").glob("*"))
