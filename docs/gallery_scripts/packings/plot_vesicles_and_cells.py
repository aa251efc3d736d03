"""
Vesicles and cells: outlines that bend, and a preferred shape
=============================================================

Onsets of droplets with line tension, of stiff outlines, and of cells that prefer a long perimeter. See
:doc:`/how_to/vesicles_and_cells`.
"""

import matplotlib.pyplot as plt

import jamlab

# %%
# One random start. Cells with a shape index of 3.8 are not round, and jam at a higher packing fraction.

LAWS = {
    "line tension": {},
    "bending stiffness": {"kappa": 0.2, "theta0": 0.0, "kl": 5.0},
    "preferred shape": {"gamma": 0.0, "kl": 5.0, "p0": 3.8, "kappa": 0.02},
}
figure, axes = plt.subplots(1, 3, figsize=(13, 5), layout="constrained")
for ax, (name, law) in zip(axes, LAWS.items(), strict=True):
    p = jamlab.jam(16, "dp", seed=2, law=law)
    p.plot(ax)
    shape = jamlab.shape_factors(p).mean()
    ax.set_title(rf"{name}: $\rho_J$ = {jamlab.packing_fraction(p):.3f}, $\mathcal{{A}}$ = {shape:.3f}")
