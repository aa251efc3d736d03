"""
Number of sides of voids
========================

Share of voids with three to six sides against the packing fraction of droplets. Near confluence only Plateau borders
remain.
"""

import matplotlib.pyplot as plt
import numpy as np

import jamlab
from jamlab.plotting import label_axes

onset = jamlab.jam(model="dp", n=32, seed=1)
sweep = [onset, *jamlab.compress(onset, to=0.97, step=0.02)]
found = [jamlab.voids(jamlab.remove_rattlers(p)).sides for p in sweep]
rho = [jamlab.packing_fraction(p) for p in sweep]

figure, ax = plt.subplots(figsize=(5.6, 4), layout="constrained")
for sides, color in zip((3, 4, 5, 6), ("#0072B2", "#D55E00", "#009E73", "#CC79A7"), strict=True):
    ax.plot(rho, [np.mean(s == sides) for s in found], "o-", color=color, label=f"{sides} sides")
label_axes(ax, "true packing fraction ρ", "share of voids")
ax.legend()
