"""Figures of the studies beside stored pictures, pixel by pixel, see tests/figures/test_pictures.py."""

from functools import cache

import flow_tables
import pandas as pd
import pytest
from bare_pictures import HERE, artists, bare, covers_points, picture
from matplotlib.legend import Legend

from studies import pages
from studies.ensemble_tables import EnsembleTables
from studies.reference_data import reference_tables

paper_tables = cache(reference_tables)


def checked(figure, labels, entries):
    """The figure, if its axes name quantity and unit, and legends of so many entries cover no point."""
    figure.draw_without_rendering()
    assert [(axes.get_xlabel(), axes.get_ylabel()) for axes in figure.axes] == labels
    assert sum(len(legend.get_texts()) for legend in artists(figure, Legend)) == entries
    assert not covers_points(figure)
    return figure


@picture
def test_boromand_9():
    """Contacts, shape and missing contacts of droplets with their bands, and the fit and the slope of the paper."""
    rho, z, missing = r"true packing fraction $\rho$", "coordination z", r"$z_{conf} - z$"
    labels = [(rho, z), (r"shape factor $\mathcal{A} - 1$", rho), (r"$1 - \rho$", missing)]
    return bare(checked(pages.draw("boromand-9", paper_tables()).figure, labels, 4), columns=3)


@picture
def test_baumgarten_1():
    """G' and G'' over eleven decades with the slopes of the paper; every point as the studies write it."""
    drawing = pages.draw("baumgarten-1", paper_tables())
    stored = pd.read_csv(HERE / "baseline" / "baumgarten-1.csv")
    pd.testing.assert_frame_equal(drawing.table, stored, rtol=1e-6, check_dtype=False)
    labels = [(r"frequency $\omega\,\tau_1$", "$G'$ (filled), $G''$ (open)  [$k$]")]
    return bare(checked(drawing.figure, labels, 1))


FLOWS = {  # figures of flow in time, from tables in which known laws hold, and how many panels stand in a row
    "flow-curves": 3,  # from dark to light, their means over pressure, the law with a yield stress through one of them
    "collapse": 2,  # one line through onset, and its two branches
    "amplitudes": 4,  # storage filled, loss dashed, at three frequencies; softening and yielding over pressure
    "equivalent-damping": 2,  # errors over reduced frequency, with a grey band
}


flow_table = cache(lambda name: flow_tables.TABLES[name]())


def critical_flow(name):
    return flow_tables.flow(critical=True)


@pytest.mark.slow
@picture
@pytest.mark.parametrize("name", FLOWS)
def test_flows(name):
    tables = EnsembleTables(critical_flow if name == "collapse" else flow_table)
    return bare(pages.draw(f"dynamics-{name}", tables).figure, columns=FLOWS[name])
