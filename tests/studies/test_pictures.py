"""Figures of the studies beside stored pictures, pixel by pixel, see tests/figures/test_pictures.py."""

from bare_pictures import artists, bare, covers_points, picture
from matplotlib.legend import Legend

from studies import pages
from studies.reference_data import reference_tables


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
    return bare(checked(pages.draw("boromand-9", reference_tables()).figure, labels, 4), columns=3)
