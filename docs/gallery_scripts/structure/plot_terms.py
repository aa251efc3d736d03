"""
Terms in a picture
==================

The words of :doc:`/explanation/terms` on packings of 16 disks and of 8 droplets.
"""

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle
from numpy.typing import ArrayLike, NDArray

import jamlab

RED = "#D55E00"
figure, axes = plt.subplots(2, 2, figsize=(9.6, 9.6), layout="constrained")


def name(ax: Axes, text: str, place: ArrayLike, shift: tuple[float, float], color: str = "black") -> None:
    """Write a term in a panel, with an arrow to a place."""
    box = {"boxstyle": "round,pad=0.25", "facecolor": "white", "edgecolor": color}
    arrow = {"arrowstyle": "->", "color": color, "linewidth": 1.4}
    look: dict[str, Any] = {"ha": "center", "fontsize": 11, "zorder": 9}
    x, y = np.asarray(place)
    ax.annotate(text, (x, y), shift, textcoords="offset points", bbox=box, arrowprops=arrow, **look)


def in_cell(p: jamlab.Packing, places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Images of places in the periodic cell."""
    return (places @ np.linalg.inv(p.box) % 1.0) @ p.box


# Onset. The backbone carries load; the rattler, in grey, has fewer than three contacts.

onset = jamlab.jam(n=16, seed=1)
network = jamlab.contacts(onset)
network.plot(axes[0, 0])
places = in_cell(onset, onset.positions)
from_middle = np.hypot(*(places - onset.box.sum(axis=0) / 2).T)
name(axes[0, 0], "rattler", places[network.rattlers][0], (-45, -75))
name(axes[0, 0], "disk of the\nbackbone (site)", places[from_middle.argmin()], (-75, -60))
axes[0, 0].set_title(f"onset: φ = ρ = {onset.phi:.3f}")

# A marginal contact: drag holds it at zero gap.

run = jamlab.shear(jamlab.pack(n=16, pressure=1e-3, seed=1), rate=0.03, strain=0.03, rows=6, snapshot_every=0.005)
frame = run.frames[-2]
i, j = np.triu_indices(frame.n, 1)
apart = frame.positions[j] - frame.positions[i]
apart -= np.round(apart @ np.linalg.inv(frame.box)) @ frame.box
radii = frame.disk_diameters / 2
gap = np.hypot(*apart.T) - radii[i] - radii[j]
held, other = np.argsort(np.abs(gap))[:2]
print(f"marginal contact: gap {gap[held]:.0e} d; all others overlap or are open by {abs(gap[other]):.0e} d or more")

frame.plot(axes[0, 1])
start = in_cell(frame, frame.positions)[i[held]]
touch = start + apart[held] * radii[i[held]] / np.hypot(*apart[held])
axes[0, 1].plot(*np.array([start, start + apart[held]]).T, color=RED, linewidth=3)
name(axes[0, 1], "marginal contact", touch, (-90, -70), RED)
axes[0, 1].set_title("in flow")

# Handover: droplets take the place of compressed disks (dashed).

*_, disks = jamlab.compress(jamlab.jam(n=8, seed=1), to=0.88, step=0.02)
droplets = jamlab.droplets_from_disks(disks)
droplets.plot(axes[1, 0])
scale = droplets.box[0, 0] / disks.box[0, 0]
for centre, diameter in zip(in_cell(disks, disks.positions) * scale, disks.disk_diameters * scale, strict=True):
    x, y = centre
    axes[1, 0].add_patch(Circle((x, y), diameter / 2, fill=False, linestyle="--", linewidth=1.2))
axes[1, 0].set_title("handover from disks to droplets")

# Sites of droplets are the vertices of their outlines; rims surround the outlines.

*_, dense = jamlab.compress(droplets, to=0.93, step=0.01)
dense.plot(axes[1, 1])
first, last = np.asarray(dense.offsets)[2:4]
outline = dense.positions[first:last]
outline = outline + in_cell(dense, outline[:1]) - outline[:1]
middle = outline.mean(axis=0)
rim = outline + (outline - middle) / np.hypot(*(outline - middle).T)[:, None] * dense.params["delta"] / 4
axes[1, 1].plot(*outline.T, "o", color="black", markersize=6)
name(axes[1, 1], "vertex (site)", outline[0], (-60, -50))
name(axes[1, 1], "rim, width δ/2", rim[6], (60, 60))
reach = np.array([-0.85, 0.85])
axes[1, 1].set(xlim=middle[0] + reach, ylim=middle[1] + reach, title="droplets with rims")
