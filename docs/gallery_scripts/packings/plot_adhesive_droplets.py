"""
Droplets that adhere
====================

Adhesive rims hold droplets together under tension. See :doc:`/how_to/adhesive_droplets`.
"""

import matplotlib.pyplot as plt

import jamlab
from jamlab.plotting import COLOURS, in_unit, label_axes

# %%
# A packing at the onset of repulsive droplets is expanded with adhesion. Red: contacts under tension.

onset = jamlab.jam(16, "dp", seed=1)
law = {**onset.params, "adhesion": 0.05, "adhesion_range": 0.3, "eta": 1e-3}
start = jamlab.relax(onset.with_state(params=law))
sweep = [start, *jamlab.compress(start, to=start.phi - 0.2, step=0.01, by="phi")]

figure, axes = plt.subplots(1, 3, figsize=(13, 4.8), layout="constrained")
for ax, p in zip(axes, (sweep[0], sweep[8], sweep[-1]), strict=True):
    p.plot(ax)
    jamlab.contacts(p).plot(ax, linewidth=1.5)
    ax.get_legend().remove()
    ax.set_title(rf"$\phi$ = {p.phi:.2f}, $z$ = {jamlab.contacts(p).z:.2f}")

# %%
# The tension grows as the packing expands, and falls where contacts open.

figure, ax = plt.subplots(figsize=(6, 4), layout="constrained")
ax.set_prop_cycle(color=COLOURS)
for adhesion in (0.01, 0.02, 0.05):
    p = jamlab.relax(onset.with_state(params=law | {"adhesion": adhesion}))
    states = [p, *jamlab.compress(p, to=p.phi - 0.2, step=0.01, by="phi")]
    ax.plot([p.phi for p in states], [-jamlab.evaluate(p).pressure for p in states], "o-", label=f"{adhesion}")
ax.legend(title=in_unit("adhesion", "ε/δ"))
label_axes(ax, r"nominal packing fraction $\phi$", in_unit("tension", "ε/l²"))
