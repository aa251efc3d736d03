"""
Shapes under compression
========================

The shape factor, perimeter²/(4π area), of droplets, and of disks inside their power cells.
"""

import matplotlib.pyplot as plt

import jamlab
from jamlab.plotting import label_axes

figure, ax = plt.subplots(figsize=(5.4, 4), layout="constrained")
disks, droplets = jamlab.jam(n=16, seed=1), jamlab.jam(model="dp", n=16, seed=1)
for onset, name, color in ((disks, "disks", "#D55E00"), (droplets, "droplets", "#0072B2")):
    sweep = [onset, *jamlab.compress(onset, to=0.98, step=0.01)]
    start = jamlab.shape_factors(onset).mean()
    rho = [jamlab.packing_fraction(p) for p in sweep]
    ax.plot(rho, [jamlab.shape_factors(p).mean() - start for p in sweep], "o-", color=color, label=name)
label_axes(ax, "true packing fraction ρ", r"mean shape factor $\mathcal{A} - \mathcal{A}_J$")
ax.legend()
