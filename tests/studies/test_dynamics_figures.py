"""Figures of flow in time from tables in which known laws hold."""

import drawn_figures
import flow_tables
import numpy as np
import pytest
from drawn_figures import tables

from studies.dynamics.flow_curves import balanced_disks, yield_law_interval
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import of_packings
from studies.papers.statements import measure
from studies.reference_data import reference_tables


def drawn(name):
    return drawn_figures.drawn(f"dynamics-{name}")


def curve(name, panel, series):
    table = drawn(name).table
    return table[(table["panel"] == panel) & (table["series"] == series)]


def test_collapse_finds_the_exponents():
    critical = EnsembleTables(lambda name: flow_tables.flow(critical=True))
    q, above, below = (measure(f"flow-{name}", critical).value for name in ("q-tighe", "yield", "viscosity"))
    assert q == pytest.approx(flow_tables.Q, abs=0.01)
    assert above == pytest.approx(flow_tables.Q / flow_tables.W, rel=0.05)
    assert below == pytest.approx((1 - flow_tables.Q) / flow_tables.W, rel=0.05)


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


def test_amplitudes_at_which_disks_soften_go_as_pressure():
    assert measure("flow-softening", tables()).value == pytest.approx(1.0, abs=0.05)
    soft = curve("amplitudes", "d", "softening")
    assert soft["y"].to_numpy() == pytest.approx(flow_tables.SOFT_OVER_PRESSURE * soft["x"].to_numpy(), rel=0.15)
