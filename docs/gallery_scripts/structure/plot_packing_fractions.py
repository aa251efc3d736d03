"""
Three packing fractions
=======================

The exact packing fraction, the nominal one, and the approximation that subtracts the overlaps of pairs.
"""

import matplotlib.pyplot as plt
import numpy as np

import jamlab

onset = jamlab.jam(n=32, seed=1)
sweep = list(jamlab.compress(onset, to=1.8, step=0.03, by="phi"))
phi = np.array([p.phi for p in sweep])

figure, ax = plt.subplots(figsize=(5.4, 4), layout="constrained")
styles = {"nominal": ":", "pairs": "--", "exact": "-"}
for (method, style), color in zip(styles.items(), ("#000000", "#D55E00", "#0072B2"), strict=True):
    ax.plot(phi, [jamlab.packing_fraction(p, method) for p in sweep], style, color=color, label=method)
ax.axhline(1, color="0.8", zorder=0)
ax.set(xlabel="φ", ylabel="packing fraction by each method", ylim=(0.8, 1.4))
ax.legend(loc="upper left")
