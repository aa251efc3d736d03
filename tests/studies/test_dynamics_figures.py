"""Figures of flow in time from tables in which known laws hold."""

import drawn_figures
import flow_tables
import numpy as np
import pandas as pd
import pytest
from drawn_figures import tables

from jamlab.errors import InputError
from studies import pages
from studies.dynamics.flow_curves import balanced_disks, steady_flows, yield_law_interval
from studies.ensemble_tables import OF_FLOWS, EnsembleTables
from studies.ensembles import of_packings
from studies.reference_data import reference_tables, write_tables


def drawn(name):
    return drawn_figures.drawn(f"dynamics-{name}")


def curve(name, panel, series):
    table = drawn(name).table
    return table[(table["panel"] == panel) & (table["series"] == series)]


def test_collapse_finds_the_exponents():
    critical = EnsembleTables(lambda name: flow_tables.flow(critical=True))
    drawing = pages.draw("dynamics-collapse", critical)
    values = {c.quantity.rpartition(",")[0]: c.value for c in drawing.claims}
    assert values["exponent q of stress over rate at onset"] == pytest.approx(flow_tables.Q, abs=0.01)
    assert values["exponent of the yield stress"] == pytest.approx(flow_tables.Q / flow_tables.W, rel=0.05)
    viscous = values["exponent of the viscosity below onset"]
    assert viscous == pytest.approx((1 - flow_tables.Q) / flow_tables.W, rel=0.05)
    assert drawing.values["onset left free"].value == pytest.approx(flow_tables.ONSET, abs=5e-4)


@pytest.mark.slow
def test_flow_curves_fit_the_law_of_herschel_and_bulkley():
    law = drawn("flow-curves").values
    assert law["exponent of Herschel and Bulkley"].value == pytest.approx(flow_tables.HERSCHEL, abs=0.01)
    assert law["yield stress with quasi-static shear"].value == pytest.approx(flow_tables.YIELD, rel=0.05)
    assert 0.3 < drawn("flow-curves").claims[0].value < 0.6


@pytest.mark.slow
def test_the_shipped_flow_curve_tends_to_quasistatic_shear():
    """The law of Herschel and Bulkley at 0.86 has an exponent in 0.45 .. 0.55, and meets the mean at rate 0."""
    flow = balanced_disks(reference_tables().flow)
    flow = flow[(flow["phi"] == 0.86) & (flow["n"] == 256) & np.isclose(flow["tolerance"], 5e-2)]
    still = flow.loc[flow["rate"] == 0, "stress"]
    moving = yield_law_interval(*of_packings(flow[flow["rate"] > 0], "rate", "stress"))
    assert moving.low[0] < still.mean() < moving.high[0] and len(still) >= 6
    both = yield_law_interval(*of_packings(flow, "rate", "stress"))
    assert 0.45 < both.low[1] < both.value[1] < both.high[1] < 0.55


def test_yield_stresses_side_by_side():
    """Those of the flow, and, 1.3 times as high, of start-up; creep between the stresses 0.5 and 1e-3 k."""
    ways = {name.removeprefix("yield stress, "): found.value for name, found in drawn("yield").values.items()}
    assert ways["flow, law"] == pytest.approx(flow_tables.YIELD, rel=0.05)
    assert ways["flow, quasi-static"] == pytest.approx(flow_tables.YIELD, rel=0.02)
    assert ways["start-up, quasi-static"] == pytest.approx(1.3 * flow_tables.YIELD, rel=0.02)
    assert ways["creep"] == pytest.approx(np.sqrt(5e-7), rel=1e-6)
    assert len(ways) == len(drawn("yield").table.query("panel == 'c'"))


def test_overshoot():
    excess = curve("overshoot", "b", "$\\phi$ = 0.86")
    assert excess["y"].to_numpy() == pytest.approx(1.3) and len(excess) == 5
    assert "0.84" not in " ".join(drawn("overshoot").table["series"])  # nothing holds it at the start


def test_amplitudes_at_which_disks_soften_go_as_pressure():
    (exponent,) = drawn("amplitudes").claims
    assert exponent.value == pytest.approx(1.0, abs=0.05) and exponent.compared != "differs"
    soft = curve("amplitudes", "d", "softening")
    assert soft["y"].to_numpy() == pytest.approx(flow_tables.SOFT_OVER_PRESSURE * soft["x"].to_numpy(), rel=0.15)


def test_what_misses_the_collapse_of_power_laws():
    ratio = curve("power-law", "b", r"$\alpha$ = 0.50")["y"].to_numpy()
    assert ratio == pytest.approx([flow_tables.MISS, 1.0], rel=1e-6)
    checks = drawn("power-law").values
    assert checks["ratio at the lowest rate, as (b)"].value == pytest.approx(flow_tables.MISS)
    assert checks["ratio at the lowest rate, N = 64"].value == pytest.approx(1.0)


def test_error_of_equivalent_damping():
    for panel in "bc":
        assert curve("equivalent-damping", panel, r"$\alpha$ = 0.50")["y"].to_numpy() == pytest.approx(30.0)
        assert curve("equivalent-damping", panel, r"$\alpha$ = 1.00")["y"].to_numpy() == pytest.approx(0.0)


def test_a_table_without_the_runs_of_a_figure_says_which():
    few = EnsembleTables(lambda name: tables().flow.query("rate == 0") if name == "flow" else pd.DataFrame())
    for name, message in {
        "flow-curves": "no steady flow of disks with alpha = 1",
        "power-law": "no drag with alpha below 1",
        "droplets": "no droplets under Stokes drag",
    }.items():
        with pytest.raises(InputError, match=message):
            pages.draw(f"dynamics-{name}", few)
    with pytest.raises(InputError, match="a collapse takes three of each"):
        pages.draw("dynamics-collapse", EnsembleTables(lambda name: tables().flow.query("phi == 0.86")))


def test_reference_flows_are_written_and_shipped(tmp_path):
    written = write_tables(tables(), tmp_path, "none", names=OF_FLOWS)
    assert [path.stem for path in written] == list(OF_FLOWS)
    shipped = reference_tables()
    assert steady_flows(shipped.flow)["seed"].nunique() >= 6 and "flow" in shipped.made
