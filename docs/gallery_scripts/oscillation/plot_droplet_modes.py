"""
How droplets move in relaxation modes
=====================================

Every Maxwell element of G* belongs to a mode. Under contact drag the slow ones turn and shift whole droplets, which
slide past each other; what relaxes faster moves along their outlines.
"""

import matplotlib.pyplot as plt
import numpy as np

import jamlab
from jamlab.plotting import in_unit

*_, p = jamlab.compress(jamlab.jam(8, "dp", seed=1), to=0.88, step=0.02)
bins = np.geomspace(1e-5, 1e5, 31)
figure, axes = plt.subplots(1, 2, figsize=(8.4, 3.6), layout="constrained")
for ax, law in zip(axes, (jamlab.ContactDamping(), jamlab.StokesDrag()), strict=True):
    m = jamlab.mode_character(p, law)
    parts = [m.strengths * part for part in (m.translation, m.rotation, m.along, m.across)]
    ax.hist([m.rates] * 4, bins, weights=parts, stacked=True, color=["#0072B2", "#56B4E9", "#E69F00", "#CC79A7"])
    ax.set(xscale="log", xlabel=r"rate $\lambda\,\tau_1$", ylabel=in_unit("strength", m.unit), title=str(law))
axes[0].legend(["translation", "rotation", "along outlines", "across outlines"], loc="upper right")
