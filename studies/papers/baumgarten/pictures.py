"""Draw the pictures of Baumgarten & Tighe: the motion of disks in fig 1."""

from typing import Any

import numpy as np

from jamlab.packing.hdf5 import read
from jamlab.packing.neighbors import moves_home
from jamlab.plotting.palette import BLACK, BLUE
from jamlab.plotting.periodic_cell import circles, fill_everywhere, frame_cell
from jamlab.rheology.complex_modulus import complex_modulus
from jamlab.rheology.displacement_correlation import oscillating_displacements
from studies.ensemble_tables import EnsembleTables
from studies.panels import Drawing, drawing, write_list
from studies.papers.baumgarten.spectra import format_power
from studies.papers.statements import caption
from studies.tables import DATA

SHEARED = "packing_k.h5"  # `jamlab pack --n 512 --pressure 1e-4 --seed 1 --ensemble shear-stabilized`
REGIMES = {"slow": 1e-10, "critical": 1e-3, "fast": 1e4}  # omega of fig 1: non-affine, square root, affine
STRAIN = 0.2  # amplitude that the six panels are drawn at
PALE = {"facecolor": "#EFE9DD", "edgecolor": "#B9B2A5", "linewidth": 0.4, "rasterized": True}
SEEN = 0.02  # of the affine motion: less is no motion in a picture


def figure_1_fields(tables: EnsembleTables) -> Drawing:
    """Displacements of disks at zero and at peak stress, at a low, a critical and a high frequency, on one scale."""
    out, panels = drawing("baumgarten-1-fields", 2, len(REGIMES), 4.6, 4.9)
    packing = read(DATA / SHEARED)
    moduli = complex_modulus(packing, list(REGIMES.values()))
    assert packing.diameters is not None
    ratios = []
    for k, (regime, omega) in enumerate(REGIMES.items()):
        backbone, motion = oscillating_displacements(packing, omega)
        strain = 1 / complex(moduli.storage[k], moduli.loss[k])  # per stress
        at = backbone.positions + moves_home(backbone.positions, packing.box)
        affine = np.column_stack([at[:, 1] - 0.5 * packing.box[1, 1], np.zeros(len(at))])
        whole = (motion + strain * affine) / abs(strain)
        ratios.append(np.sqrt((np.abs(motion) ** 2).sum() / (np.abs(strain * affine) ** 2).sum()))
        for axes, u, when in ((panels[k], whole.imag, "zero"), (panels[k + len(REGIMES)], whole.real, "peak")):
            fill_everywhere(axes, circles(packing.positions, packing.diameters), packing.box, **PALE)
            dots: dict[str, Any] = {"color": BLACK, "linestyle": "none", "marker": ".", "markersize": 1}
            out.curve(axes, f"{regime}, omega = {omega:g}, {when} stress", *at.T, label=None, **dots)
            look: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": 1.0, "color": BLUE, "width": 0.0035}
            if np.abs(u).max() > SEEN * np.abs(whole).max():
                axes.quiver(*at.T, *(STRAIN * u).T, **look)
            else:
                axes.text(0.5, 0.5, "no displacement", transform=axes.transAxes, fontsize=14, ha="center")
            frame_cell(axes, packing.box)
            axes.set_title(rf"{when} stress, $\omega\,\tau_1 = {format_power(omega)}$", fontsize=12)
    out.caption = caption(out.name, strain=STRAIN, n=packing.n, ratios=write_list(ratios, ".2f"))
    return out
