"""
Sticky disks: rigidity under tension
====================================

Disks that attract each other jam far below the repulsive onset, in networks that are partly under tension. See
:doc:`/how_to/sticky_disks`.
"""

import matplotlib.pyplot as plt

import jamlab
from jamlab.plotting import COLOURS, in_unit, label_axes

# %%
# One random start at three packing fractions. Contacts that push are blue, those that pull red. The largest rigid
# cluster (pebble game) spans the packing where the shear modulus becomes positive.

figure, axes = plt.subplots(1, 3, figsize=(13, 5), layout="constrained")
for ax, phi in zip(axes, (0.5, 0.62, 0.74), strict=True):
    p = jamlab.pack(n=128, phi=phi, seed=1, law={"stickiness": 0.1})
    jamlab.contacts(p).plot(ax, linewidth=0.8)
    ax.get_legend().remove()
    share, g = jamlab.rigid_clusters(p).sizes[0] / p.n, jamlab.shear_modulus(p)
    ax.set_title(rf"$\phi$ = {phi}: rigid {100 * share:.0f} %, $G$ = {max(g, 0):.3f} k")

# %%
# Expanded in small steps, a packing carries tension until it breaks.

start = jamlab.pack(n=64, pressure=0.0, seed=1, law={"stickiness": 0.05})
sweep = [start, *jamlab.compress(start, to=start.phi - 0.15, step=0.01, by="phi")]
figure, ax = plt.subplots(figsize=(6, 4), layout="constrained")
ax.plot([p.phi for p in sweep], [jamlab.evaluate(p).pressure for p in sweep], "o-", color=COLOURS[2])
ax.axhline(0, color="black", linewidth=0.8)
label_axes(ax, r"nominal packing fraction $\phi$", in_unit("pressure $p$", "k"))
