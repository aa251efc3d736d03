"""Draw the pictures of Baumgarten & Tighe: the motion of disks in fig 1, and what fig 2 damps."""

from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.packing.hdf5 import read
from jamlab.packing.neighbors import moves_home
from jamlab.plotting.palette import BLACK, BLUE, GREEN, RED
from jamlab.plotting.periodic_cell import circles, fill_everywhere, frame_cell
from jamlab.rheology.complex_modulus import complex_modulus
from jamlab.rheology.displacement_correlation import oscillating_displacements
from studies.ensemble_tables import EnsembleTables
from studies.panels import Drawing, drawing, write_list
from studies.papers.baumgarten.spectral_groups import format_power
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


def figure_2(tables: EnsembleTables) -> Drawing:
    """What is damped: relative motion at a contact, and motion against the affine flow of the fluid."""
    out, (contact, flow) = drawing("baumgarten-2", 1, 2, 4.6, 4.2)
    centres = np.array([[-0.3, -0.2], [0.7, 0.15]])
    radii = np.array([0.58, 0.5])
    along = (centres[1] - centres[0]) / np.linalg.norm(centres[1] - centres[0])
    across = np.array([-along[1], along[0]])
    for centre, radius, name in zip(centres, radii, "ij", strict=True):
        _disk(out, contact, centre, radius, name)
    touch = centres[0] + radii[0] * along
    for direction, colour, text in (
        (-0.45 * along, RED, r"$\Delta\dot u^\parallel$"),
        (0.7 * across, GREEN, r"$\Delta\dot u^{\perp,c}$"),
    ):
        _arrow(contact, touch, direction, colour, text)
    contact.set_title(r"(a) contact damping: $k\tau_1$ and $\beta k\tau_1$", fontsize=11)
    middle = np.array([0.1, 0.3])
    for height in np.linspace(-0.9, 1.1, 8):
        for start in (-1.0, 0.9):
            arrow = {"arrowstyle": "->", "color": BLUE, "alpha": 0.6}
            flow.annotate("", (start + 0.55 * height, height), (start, height), arrowprops=arrow)
    _disk(out, flow, middle, 0.42, "i")
    _arrow(flow, middle, np.array([0.8, 0.45]), BLACK, r"$\dot u_i$")
    _arrow(flow, middle, np.array([0.7, 0.0]), BLUE, r"$v_{\rm aff}$")
    flow.set_title(r"(b) Stokes drag: $\dot u_i - v_{\rm aff}(r_i)$", fontsize=11)
    for axes in (contact, flow):
        axes.set_aspect("equal")
        axes.axis("off")
        axes.set_xlim(*((-1.1, 1.5) if axes is contact else (-1.6, 1.7)))
        axes.set_ylim(-1.2, 1.4)
    out.caption = caption(out.name)
    return out


def _disk(out: Drawing, axes: Any, centre: Array, radius: float, name: str) -> None:
    angle = np.linspace(0, 2 * np.pi, 73)
    x, y = centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle)
    axes.fill(x, y, facecolor=PALE["facecolor"], alpha=0.8, linewidth=0)
    out.curve(axes, f"disk {name}", x, y, label=None, color=BLACK, linewidth=1.2)
    axes.text(centre[0], centre[1] - 0.6 * radius, f"${name}$", fontsize=13, ha="center")


def _arrow(axes: Any, start: Array, way: Array, colour: str, text: str) -> None:
    axes.annotate("", start + way, start, arrowprops={"arrowstyle": "-|>", "color": colour, "linewidth": 2})
    axes.text(*(start + way + 0.12 * np.sign(way)), text, color=colour, fontsize=13, ha="center", va="center")
