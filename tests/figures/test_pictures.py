"""Pictures beside stored ones, pixel by pixel: colours, order of drawing, markers, legends.

Both models are drawn in the stored states `states/*.h5`, so that no rounding of LAMMPS moves a line. Text is left out
and panels stand in a fixed grid, since fonts and their sizes differ between versions of matplotlib; what the text says
is compared as text. Edges are sharp, which keeps the files small. After a change that is meant, draw the stored
pictures again, look at them, and commit them:

    pytest tests/figures/test_pictures.py --mpl-generate-path=tests/figures/baseline
"""

from functools import cache

import numpy as np
import pandas as pd
from bare_pictures import HERE, artists, bare, both, picture, state
from matplotlib.legend import Legend

import jamlab
from jamlab.figures.packing_pictures import draw_cells, draw_overlaps, draw_packing, draw_voids, modulus_figure
from jamlab.packing.deformation import at_phi
from jamlab.rheology.mean_spectrum import Spectra
from jamlab.studies import gallery
from jamlab.studies.cost.chart import Point, curve_figure
from jamlab.studies.failure.map import failure_figure
from jamlab.studies.reference_data import reference_tables
from jamlab.studies.registry import MAPS


def paper_figure(name):
    return gallery.draw(name, shipped())


@cache
def shipped():
    return reference_tables()


@picture
def test_packings():
    """Large blue, small pink, rattlers grey, contacts black."""
    return both(draw_packing)


@picture
def test_voids():
    """One colour for each number of sides, digits in large voids, legend below."""
    return both(draw_voids)


@picture
def test_cells():
    """Colours of local packing fraction, with their scale."""
    return both(draw_cells, width=8.0)


@picture
def test_overlaps():
    """Dark lenses, white chords; legend below."""
    return both(lambda axes, packing, title: draw_overlaps(axes, at_phi(packing, 1.2 * packing.phi), title))


def modulus():
    s = jamlab.complex_modulus(state("disks"), np.geomspace(1e-4, 1e2, 25), method="dense")
    return modulus_figure({"contact damping": Spectra((s,), "k", (True,), (s.g0,))}, "k")


def chart():
    def point(panel, method, setting, seconds, error, failed=0, default=False):
        return Point(panel, method, setting, seconds, error, 0.3 * error, 2 * error, 1e-12, 20, failed, default)

    points = [point("N = 64", "pixels", f"{k}", 1e-3 * k, 1 / k**2, failed=k > 500) for k in (10, 100, 1000)]
    points += [
        point("N = 64", "exact", "", 3e-3, 1e-14, default=True),
        point("N = 64", "broken", "", np.nan, np.nan),
        point("N = 1024", "exact", "", 4e-2, 1e-8, default=True),
        point("N = 1024", "pixels", "100", 2e-2, 1e-4),
    ]
    return curve_figure("packing fraction", "error of rho", points)


@picture
def test_failure_map():
    """Shares of runs in every cell of a shipped map, the limit of theory over them."""
    return bare(failure_figure(MAPS["moved"], MAPS["moved"].table().rows))


def checked(figure, labels, entries):
    """The figure, if its axes name quantity and unit, and legends of so many entries cover no point."""
    figure.draw_without_rendering()
    assert [(axes.get_xlabel(), axes.get_ylabel()) for axes in figure.axes] == labels
    legends = artists(figure, Legend)
    assert sum(len(legend.get_texts()) for legend in legends) == entries
    for axes in figure.axes:
        for line in axes.lines:
            places = line.get_transform().transform(line.get_xydata())
            assert not any(legend.get_window_extent().count_contains(places) for legend in legends)
    return figure


@picture
def test_complex_modulus():
    """G' filled, G'' open, slopes dotted."""
    return bare(
        checked(modulus(), [(r"angular frequency $\omega\,\tau_1$", "complex shear modulus $G^*_{xy}$  [k]")], 2)
    )


@picture
def test_speed_accuracy_chart():
    """Curves with bands along their dials, what is exact below a break, the default ringed, open where some failed."""
    return bare(checked(chart(), [("CPU time on one core, s", "error of rho")] * 2, 5), columns=2)


@picture
def test_boromand_9():
    """Coordination and shape against true packing fraction, both models with their bands."""
    shape = r"$\mathcal{A} - 1$  (DP: $\mathcal{A} - \mathcal{A}_J$)", r"true packing fraction $\rho$"
    figure = checked(paper_figure("boromand-9").figure, [(shape[1], "coordination z"), shape], 4)
    return bare(figure, columns=2)


@picture
def test_baumgarten_1():
    """G' and G'' over eleven decades with the slopes of the paper; every point as `jamlab figure` writes it."""
    drawing = paper_figure("baumgarten-1")
    stored = pd.read_csv(HERE / "baseline" / "baumgarten-1.csv")
    pd.testing.assert_frame_equal(drawing.table, stored, rtol=1e-6, check_dtype=False)
    labels = [(r"frequency $\omega\,\tau_1$", "$G'$ (filled), $G''$ (open)  [$k$]")]
    return bare(checked(drawing.figure, labels, 1))
