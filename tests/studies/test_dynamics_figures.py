"""Numbers of flow in time: collapses through a critical point recover exponents; flow curves meet slow shear."""

import numpy as np
import pytest

from studies.dynamics.collapse import collapse_through
from studies.dynamics.flow_curves import steady_flows, with_limit, yield_law_interval
from studies.ensembles import of_packings
from studies.reference_data import open_tables

SHAPE = (-0.02, 0.1, 0.4, 0.3)  # of ln f, highest power first
X, S = (part.ravel() for part in np.meshgrid(np.linspace(0.80, 0.88, 9), np.geomspace(1e-4, 1e-2, 5)))


def data(q, w, critical=0.84):
    z = (X - critical) / S**w
    return S**q * np.exp(np.polyval(SHAPE, z))


@pytest.mark.parametrize(("q", "w"), [(0.4, 0.3), (0.7, 0.25)])
def test_exponents_and_the_scaling_function_are_recovered(q, w):
    found = collapse_through(X, S, data(q, w), (0.835, q + 0.1, w + 0.05), order=3)
    assert [found.critical, found.q, found.w] == pytest.approx([0.84, q, w], abs=1e-5)
    z = np.linspace(-0.2, 0.3, 5)
    assert found.function(z) == pytest.approx(np.exp(np.polyval(SHAPE, z)), rel=1e-4)
    left = np.log(data(q, w)) - np.polyval(np.polyfit(X, np.log(data(q, w)), 3), X)  # one curve for all s
    assert found.spread < 1e-6 and found.before == pytest.approx(np.sqrt(np.mean(left**2)), rel=1e-6)


@pytest.mark.slow
def test_the_shipped_flow_curve_tends_to_quasistatic_shear():
    """The law of Herschel and Bulkley at 0.86 has an exponent in 0.45 .. 0.55, and meets the mean at rate 0."""
    tables = open_tables()
    flow = steady_flows(tables.flow, phi=0.86)
    all_rates = with_limit(flow, tables, phi=0.86)
    still = all_rates.loc[all_rates["rate"] == 0, "stress"]
    moving = yield_law_interval(*of_packings(flow, "rate", "stress"))
    assert moving.low[0] < still.mean() < moving.high[0] and len(still) >= 6
    both = yield_law_interval(*of_packings(all_rates, "rate", "stress"))
    assert 0.45 < both.low[1] < both.value[1] < both.high[1] < 0.55


def test_what_the_page_says_of_layers_follows_from_the_table():
    """Steps and largest stress of disks whose drag is finite at zero overlap."""
    table = open_tables().read("flow-layers")
    finite = table[(table["exponent"] == 2) & (table["stopped"] == 0)]
    thin = finite[finite["layer"] <= 1e-4]
    assert (thin["ratio_low"].min(), round(thin["ratio_high"].max())) == (1.2, 20)
    assert thin["largest_change"].abs().max() <= 3 and finite["largest_change"].min() == -44
    assert 3 * 5 * 4 * 2 + 3 * 5 - len(table) == 36  # two laws at four rates each, and one with a row for all rates
