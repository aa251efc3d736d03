"""Pictures beside stored ones, pixel by pixel: colours, order of drawing, markers, legends.

Both models are drawn in the stored states `states/*.h5`, so that no rounding of LAMMPS moves a line. Text is left out
and panels stand in a fixed grid, since fonts and their sizes differ between versions of matplotlib; what the text says
is compared as text. Edges are sharp, which keeps the files small. After a change that is meant, draw the stored
pictures again, look at them, and commit them:

    pytest tests/figures/test_pictures.py --mpl-generate-path=tests/figures/baseline
"""

import numpy as np
from bare_pictures import bare, both, covers_points, picture, state

import jamlab
from jamlab.cli.gstar import modulus_figure
from jamlab.rheology.mean_spectrum import mean_spectra


@picture
def test_voids():
    """One colour for each number of sides, digits in large voids, legend below."""
    return both(lambda axes, packing, title: jamlab.voids(packing).plot(axes))


@picture
def test_cells():
    """Colours of local packing fraction, with their scale."""
    return both(lambda axes, packing, title: jamlab.tessellation(packing).plot(axes), width=8.0)


def modulus():
    omega = np.geomspace(1e-4, 1e2, 25)
    return modulus_figure(mean_spectra([state("disks")], omega, method="dense"))


@picture
def test_complex_modulus():
    """G' filled, G'' open; axes name quantity and unit, and the legend covers no point."""
    figure = modulus()
    figure.draw_without_rendering()
    (axes,) = figure.axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == (
        r"angular frequency $\omega\,\tau_1$",
        "complex shear modulus $G^*_{xy}$  [k]",
    )
    assert len(axes.get_legend().get_texts()) == 2 and not covers_points(figure)
    return bare(figure)
