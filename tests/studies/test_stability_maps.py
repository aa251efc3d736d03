"""Stability maps: a cell of each on both sides of its boundary, and wrong states that no check may let through."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import jamlab
from studies.ensemble_tables import EnsembleTables
from studies.reference_data import open_tables
from studies.registry import MAPS
from studies.stability import flow, moduli, packings
from studies.stability import map as stability
from studies.stability.map import SILENT, Map, Trial, attempt, balanced, judged, shares, tick_text

CELLS = {  # map: x, y, verdict, on one side of the boundary and on the other
    "large-n": [(1e-12, 16, "converged")],
    "pressure": [(1e-2, 12, "converged"), (0.5, 12, "refused")],
    "polydisperse": [(2.0, 0.5, "converged"), (11.0, 0.5, "refused")],
    "onset-tolerance": [(1e-12, 4, "converged"), (1e-6, 4, "refused")],
    "sweep-step": [(0.02, 0.85, "converged")],
    "moved": [(1e-10, 1e-2, "converged"), (1e-2, 1e-2, "refused")],
    "spectrum-frequency": [(1e-30, 1e-2, "converged"), (1e30, 1e-2, "converged")],
    "droplet-elasticity": [(0.4, 300.0, "converged"), (300.0, 1.0, "refused")],
    "droplet-density": [(0.88, 2.0, "converged")],
    "droplet-timestep": [(0.05, 30.0, "converged"), (10.0, 30.0, "diverged")],
    "flow-tolerance": [(1e-2, 0.1, "converged"), (0.3, 0.1, "refused")],
    "flow-background": [(1e-4, 0.1, "converged"), (1e-4, 2e3, "refused")],
    "flow-power": [(0.5, 0.1, "converged"), (0.34, 0.1, "refused")],
    "flow-droplets": [(1e-2, 10.0, "converged"), (0.3, 1.0, "refused")],
    "oscillation-amplitude": [(1e-6, 1.0, "converged"), (0.02, 1.0, "another minimum")],
}


@pytest.mark.parametrize(("name", "cell"), [(name, cell) for name, cells in CELLS.items() for cell in cells])
def test_a_cell(name, cell):
    x, y, verdict = cell
    trial = attempt(lambda: MAPS[name].attempt(x, y, 1))
    assert trial.verdict == verdict, trial.note
    assert trial.excess <= 1


# wrong numbers, which every check must see ---------------------------------------------------------------------------


@pytest.fixture(scope="module")
def packing():
    return jamlab.pack(8, 1e-2, 1)


@pytest.fixture(scope="module")
def run(packing):
    return jamlab.shear(packing, 0.1, 0.01, rows=2)


def test_a_claim_that_fails_its_check_is_silent():
    """No number is no proof; what says that it failed is not silent."""
    nan = float("nan")
    ends = {("converged", 2.0): SILENT, ("another minimum", 2.0): SILENT, ("converged", nan): SILENT}
    ends |= {("converged", 1.0): "converged", ("stalled", 2.0): "stalled"}
    assert [judged(Trial(said, "", error, 1.0)).verdict for said, error in ends] == list(ends.values())


def test_wrong_forces_and_moduli_are_seen(packing):
    moved = packing.with_state(positions=packing.positions + 1e-10 * np.sin(packing.positions))
    g = jamlab.shear_modulus(packing, direction="simple")
    for right, wrong in (
        (balanced("converged", packing, 1e-12), balanced("converged", moved, 1e-12)),
        (packings.modulus_trial(packing, g), packings.modulus_trial(packing, 1.001 * g)),
    ):
        assert (judged(right).verdict, judged(wrong).verdict) == ("converged", SILENT)


@pytest.mark.parametrize("entry", ["energy", "elastic_stress", "viscous_stress"])
def test_wrong_numbers_of_a_flow_are_seen(run, entry):
    check = getattr(flow, f"{entry.partition('_')[0]}_trial")
    assert judged(check(run)).verdict == "converged"
    wrong = getattr(run, entry).copy()
    wrong[-1] += 0.3 * np.abs(run.stress).max()
    assert judged(check(replace(run, **{entry: wrong}))).verdict == SILENT


def test_flow_without_balance_of_energy_is_not_called_converged(run, monkeypatch):
    assert flow.try_shear(run.frames[0], 0.1).verdict == "converged"
    lost = 1.1 * run.dissipated
    monkeypatch.setattr(flow, "shear", lambda *given, **how: replace(run, dissipated=lost))
    assert flow.try_shear(run.frames[0], 0.1).verdict == "stalled"


@pytest.mark.parametrize(("off", "verdict"), [(0.005, "converged"), (0.02, "another minimum")])
def test_another_path_is_seen(run, monkeypatch, off, verdict):
    """1 % of the largest stress, from steps finer than any in the map."""
    assert min(MAPS["flow-tolerance"].x.values) > flow.FINEST
    assert min(MAPS["sweep-step"].x.values) > packings._FINEST
    moved = replace(run, stress=run.stress + off * np.abs(run.stress).max() * (run.strain == run.strain[-1]))
    monkeypatch.setattr(flow, "shear", lambda *given, tolerance, **how: run if tolerance == flow.FINEST else moved)
    assert flow.try_tolerance(run.frames[0], 0.1, 1e-4).verdict == verdict


def test_a_wrong_spectrum_is_seen(monkeypatch):
    right = moduli.complex_modulus

    def off(*given, **how):
        s = right(*given, **how)
        return replace(s, loss=1.001 * s.loss)

    assert attempt(partial(moduli.try_spectrum, 1.0, 1e-2, 2)).verdict == "converged"
    monkeypatch.setattr(moduli, "complex_modulus", off)
    assert attempt(partial(moduli.try_spectrum, 1.0, 1e-2, 2)).verdict == SILENT


def test_a_minimiser_that_lies_is_seen(monkeypatch):
    """`relax_session` that stops early and calls it converged."""
    packings.disks(8, 1)  # kept, and made by what does not lie

    def lies(session, tolerance):
        found = jamlab.protocols.relaxation.relax_session(session, 1e-6)
        return replace(found, evaluation=replace(found.evaluation, max_force=0.1 * tolerance), converged=True)

    monkeypatch.setattr(packings, "relax_session", lies)
    assert attempt(partial(packings.try_tolerance, 1e-12, 8, 1)).verdict == SILENT


# tables and pictures -------------------------------------------------------------------------------------------------


def test_a_map_is_drawn_with_its_limit_and_defaults(monkeypatch):
    """Runs that fail beyond x = 50 y, half of them from 5 y on; rows in any order, as after an interruption."""

    def run(x, y, seed):
        if x > 1e3:
            raise jamlab.InputError(f"x = {x:g}: too large")
        return Trial("stalled" if x > (5 if seed % 2 else 50) * y else "converged", "note", 0.5, 1.0)

    conditions = {"across": {"factors": [1e-2, 1e4, 13]}, "up": {"values": [0.1, 1.0, 10.0]}, "runs": 4}
    words = dict.fromkeys(("title", "x", "y", "meaning", "check", "limit"), "limit")
    monkeypatch.setitem(stability.WORDS, "t", words | conditions)
    chart = Map("t", run, lambda y, seed: 30 * y, (1.0, 1.0))
    table = pd.DataFrame([row for y in chart.y.values for row in chart.rows(y)])
    converged = shares(chart, table, "converged")
    assert converged.shape == (3, 13) and set(np.unique(converged)) == {0.0, 0.5, 1.0}
    assert shares(chart, table, "refused")[:, -1].tolist() == [1, 1, 1]
    drawn = chart.draw(EnsembleTables(lambda name: table[::-1]))
    (axes,) = drawn.figure.axes
    assert [tick.get_text() for tick in axes.get_yticklabels()] == ["0.1", "1", "10"]
    ticks = {1e-5: "$10^{-5}$", 3e-4: "$3\\cdot10^{-4}$", 1960.0: "1960", 0.25: "0.25"}
    assert {v: tick_text(v) for v in ticks} == ticks
    limit, *defaults = axes.get_lines()
    assert limit.get_label() == "limit" and len(defaults) == 2
    np.testing.assert_allclose(limit.get_xdata(), chart.x.places(np.array([3.0, 30.0, 300.0])))
    assert len(drawn.text[0].rows) == (table["converged"] < table["runs"]).sum() < len(table)


def test_what_ships_is_complete_without_a_silent_wrong_number_and_counted_in_the_documentation():
    assert CELLS.keys() == MAPS.keys()
    tables = {name: open_tables().read(name) for name in MAPS}
    for name, table in tables.items():
        chart = MAPS[name]
        assert len(table) == len(chart.x.values) * len(chart.y.values) >= 144, name
        assert table[SILENT].sum() == 0 and (table["runs"] == table["runs"][0]).all(), name
        assert not np.isnan(shares(chart, table, "converged")).any(), name
    runs = f"{sum(int(table['runs'].sum()) for table in tables.values()):,} runs".replace(",", " ")
    known = {name for name in MAPS if MAPS[name].words["elsewhere"].startswith("contacts change")}  # jamlab says so
    changed, ended = (
        sum(int(tables[n]["another minimum"].sum()) for n in names) for names in (known, MAPS.keys() - known)
    )
    parted = tables["flow-tolerance"]["another minimum"].sum()
    compared = tables["flow-tolerance"]["converged"].sum() + parted  # the others were refused, or stalled
    for page in ("README.md", "docs/explanation/accuracy.md"):
        text = " ".join((Path(__file__).parents[2] / page).read_text(encoding="utf-8").split())
        assert runs in text and f" {ended} runs " in text
    assert f"In {changed} further runs contacts changed" in text
    assert f"with a good energy balance, {parted} of {compared} runs differ" in text
