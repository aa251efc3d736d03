"""
Motion of droplets in relaxation modes
======================================

Every Maxwell element of G* belongs to a mode. With contact damping slow modes rotate and translate whole droplets;
faster modes move vertices along the outlines.
"""

import matplotlib.pyplot as plt
import numpy as np

import jamlab
from jamlab.plotting import in_unit, label_axes

*_, p = jamlab.compress(jamlab.jam(8, "dp", seed=1), to=0.88, step=0.02)
bins = np.geomspace(1e-3, 1e4, 29)
figure, axes = plt.subplots(1, 2, figsize=(10, 4.2), layout="constrained")
laws = {"contact damping": jamlab.ContactDamping(), "Stokes drag": jamlab.StokesDrag()}
for ax, (name, law) in zip(axes, laws.items(), strict=True):
    m = jamlab.mode_character(p, law)
    parts = [m.strengths * part for part in (m.translation, m.rotation, m.along, m.across)]
    ax.hist([m.rates] * 4, bins, weights=parts, stacked=True, color=["#0072B2", "#56B4E9", "#E69F00", "#CC79A7"])
    label_axes(ax, r"rate $\lambda\,\tau_1$", in_unit("strength", m.unit))
    ax.set(xscale="log", title=name)
axes[1].legend(["translation", "rotation", "along outlines", "across outlines"], loc="upper left")
