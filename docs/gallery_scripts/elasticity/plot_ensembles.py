"""
Negative shear moduli in a fixed box
====================================

Shear modulus against direction of shear, for packings in a fixed square box and in the shear-stabilised ensemble.
See :doc:`/explanation/ensembles`.
"""

import matplotlib.pyplot as plt
import numpy as np

import jamlab
from jamlab.plotting import in_unit, label_axes

angle = np.linspace(0, np.pi, 16, endpoint=False)
print("                   p      negative in some direction   along x   mean of G")
for ensemble in ("fixed-box", "shear-stabilized"):
    for pressure in (1e-2, 1e-3, 1e-4):
        packings = [jamlab.pack(n=32, pressure=pressure, seed=seed, ensemble=ensemble) for seed in range(1, 21)]
        g = np.array([jamlab.shear_modulus(p, direction=angle) for p in packings])
        along = np.array([jamlab.shear_modulus(p, direction="simple") for p in packings])
        some = (g.min(axis=1) < 0).sum()
        print(f"{ensemble:17s} {pressure:6.0e} {some:17d} of 20 {(along < 0).sum():12d} {g.mean():11.4f}")

# %%
# Six packings of each.

angle = np.linspace(0, np.pi, 91)
figure, axes = plt.subplots(1, 2, figsize=(9.5, 3.8), layout="constrained", sharey=True)
fixed = [jamlab.pack(n=32, pressure=1e-3, seed=seed) for seed in range(1, 7)]
stable = [jamlab.pack(n=32, pressure=1e-3, seed=seed, ensemble="shear-stabilized") for seed in range(1, 7)]
for ax, packings in zip(axes, (fixed, stable), strict=True):
    for p in packings:
        ax.plot(np.degrees(angle), jamlab.shear_modulus(p, direction=angle), color="#0072B2", alpha=0.7)
    ax.axhline(0, color="black", linewidth=0.8)
    label_axes(ax, in_unit("direction of shear from x", "degrees"), in_unit("shear modulus $G$", "k"))
    ax.set_title(packings[0].ensemble)
