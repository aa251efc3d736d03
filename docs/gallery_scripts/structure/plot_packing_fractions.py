"""
Three packing fractions
=======================

The exact packing fraction, the nominal one, and the approximation that subtracts the overlaps of pairs.
"""

import matplotlib.pyplot as plt
import numpy as np

import jamlab
from jamlab.plotting import label_axes

onset = jamlab.jam(n=32, seed=1)
sweep = list(jamlab.compress(onset, to=1.8, step=0.03, by="phi"))
phi = np.array([p.phi for p in sweep])

figure, ax = plt.subplots(figsize=(5.4, 4), layout="constrained")
ax.plot(phi, [jamlab.packing_fraction(p, "nominal") for p in sweep], ":", color="#000000", label="nominal")
ax.plot(phi, [jamlab.packing_fraction(p, "pairs") for p in sweep], "--", color="#D55E00", label="pairs")
ax.plot(phi, [jamlab.packing_fraction(p) for p in sweep], "-", color="#0072B2", label="exact")
ax.axhline(1, color="0.8", zorder=0)
label_axes(ax, "nominal packing fraction φ", "packing fraction by each method")
ax.set_ylim(0.8, 1.4)
ax.legend(loc="upper left")
