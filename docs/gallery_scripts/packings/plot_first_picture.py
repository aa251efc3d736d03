"""
From onset to G*
================

Left: 64 droplets at jamming onset, with lines as wide as the forces between them. Middle: the same droplets at a true
packing fraction of 0.98, coloured by shape factor. Right: storage (solid) and loss modulus (dashed) of 256 disks at
three pressures. This is the first picture of the README.
"""

from itertools import product
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import LinearSegmentedColormap, Normalize

import jamlab
from jamlab.plotting import in_unit

BLUE, RED, GREEN, PINK, SKY, YELLOW = "#0072B2", "#D55E00", "#009E73", "#E3B4D0", "#8CCBF0", "#F0E442"

onset = jamlab.jam(n=64, model="dp", seed=1)
*_, dense = jamlab.compress(onset, to=0.98, step=0.02)
omega = np.logspace(-6, 2, 41)
disks = [jamlab.pack(256, pressure, 1, ensemble="shear-stabilized") for pressure in (1e-2, 1e-3, 1e-4)]
spectra = [jamlab.complex_modulus(p, omega) for p in disks]


def fill(ax: Axes, p: jamlab.Packing, colours: Any) -> None:
    """Fill droplets with their rims, in the cell and around it, and show the cell."""
    rims = shapely.buffer(p.polygons.shapes(), p.params["delta"] / 2)
    shapes = [np.array(rim.exterior.coords) for rim in rims]
    for move in np.array(list(product(range(-2, 3), repeat=2))) @ p.box:
        ax.add_collection(PolyCollection([s + move for s in shapes], facecolor=colours, edgecolor="white"))
    ax.set(xlim=(0, p.box[0, 0]), ylim=(0, p.box[1, 1]), aspect="equal", xticks=[], yticks=[])


def draw_forces(ax: Axes, network: jamlab.results.Contacts) -> None:
    """Draw a line between the centres of droplets that touch, as wide as their force."""
    p, force = network.packing, network.forces.size
    start = p.centroids[network.pairs[:, 0]]
    lines = np.stack([start, start + network.r], axis=1)
    for move in np.array(list(product(range(-2, 3), repeat=2))) @ p.box:
        ax.add_collection(LineCollection(lines + move, linewidths=1.5 * force / force.mean(), color="black"))


def draw_modulus(ax: Axes) -> None:
    """Draw storage and loss modulus over frequency, at each pressure."""
    for exponent, spectrum, color in zip((-2, -3, -4), spectra, (BLUE, RED, GREEN), strict=True):
        ax.loglog(omega, spectrum.storage, color=color, linewidth=2, label=f"$p = 10^{{{exponent}}}\\,k$")
        ax.loglog(omega, spectrum.loss, "--", color=color, linewidth=2)
    ax.set(xlabel=r"angular frequency $\omega\,\tau_1$", ylabel=in_unit(r"$G'$ (solid), $G''$ (dashed)", "k"))
    ax.set(title="G* of 256 disks", xlim=(omega[0], omega[-1]), ylim=(1e-5, 1e1), xticks=10.0 ** np.arange(-6, 3, 2))
    ax.grid(alpha=0.3)
    ax.legend(frameon=False)


def draw(places: Any, size: tuple[float, float]) -> Any:
    """Draw the three panels in a figure; `places` as in `plt.subplot_mosaic`, `size` in inches."""
    figure, axes = plt.subplot_mosaic(places, figsize=size, layout="constrained")
    network = jamlab.contacts(onset)
    colours = np.where(onset.params["a0"] > 1, SKY, PINK)
    fill(axes["onset"], onset, np.where(network.rattlers, "#DDDDDD", colours))
    draw_forces(axes["onset"], network)
    axes["onset"].set(title=f"onset: ρ = {jamlab.packing_fraction(onset):.3f}", xlabel="grey: rattlers")
    shape = jamlab.shape_factors(dense, rim=True)
    ends = Normalize(*np.percentile(shape, [3, 97]))
    scale = ScalarMappable(ends, LinearSegmentedColormap.from_list("", [BLUE, "#56B4E9", YELLOW]))
    fill(axes["dense"], dense, scale.to_rgba(shape))
    axes["dense"].set_title(f"compressed: ρ = {jamlab.packing_fraction(dense):.2f}")
    label = r"shape factor $\mathcal{A}$"
    figure.colorbar(scale, ax=axes["dense"], label=label, location="bottom", shrink=0.8, aspect=20, pad=0.01)
    draw_modulus(axes["modulus"])
    return figure


figure = draw([["onset", "dense", "modulus"]], (10, 3.8))
