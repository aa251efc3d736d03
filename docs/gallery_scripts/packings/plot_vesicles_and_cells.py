"""
Vesicles and cells
==================

Onsets of droplets with line tension, with bending stiffness, and with a preferred perimeter. See
:doc:`/how_to/vesicles_and_cells`.
"""

import matplotlib.pyplot as plt

import jamlab

# %%
# One random start. Droplets with line tension and vesicles are round at onset. Cells with preferred shape index 3.8 are
# not round and jam at a higher packing fraction.

LAWS = {
    "line tension": {},
    "bending stiffness": {"kappa": 0.2, "theta0": 0.0, "kl": 5.0},
    "preferred shape": {"gamma": 0.0, "kl": 5.0, "p0": 3.8, "kappa": 0.02},
}
onsets = {name: jamlab.jam(16, "dp", seed=2, law=law) for name, law in LAWS.items()}
figure, axes = plt.subplots(1, 3, figsize=(13, 4.8), layout="constrained")
for ax, (name, p) in zip(axes, onsets.items(), strict=True):
    p.plot(ax)
    shape = jamlab.shape_factors(p).mean()
    ax.set_title(rf"{name}: $\rho_J$ = {jamlab.packing_fraction(p):.3f}, $\mathcal{{A}}$ = {shape:.3f}")

# %%
# The same packings, compressed. Contacts flatten under line tension; bending stiffness resists at the corners.

figure, axes = plt.subplots(1, 3, figsize=(13, 4.8), layout="constrained")
for ax, (name, onset) in zip(axes, onsets.items(), strict=True):
    *_, p = jamlab.compress(onset, to=0.92, step=0.01)
    p.plot(ax)
    shape = jamlab.shape_factors(p).mean()
    ax.set_title(rf"{name}: $\rho$ = {jamlab.packing_fraction(p):.2f}, $\mathcal{{A}}$ = {shape:.3f}")
