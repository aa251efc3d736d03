"""
Soft spots
==========

The lowest vibrations of a dense packing are waves. A quasi-localised mode, here a pseudo-harmonic mode of Richard
et al. (2021), moves few particles. See :doc:`/how_to/vibrations`.
"""

import matplotlib.pyplot as plt

import jamlab

p = jamlab.pack(n=256, pressure=1e-1, seed=3)
modes = jamlab.lowest_modes(p, 40)
soft = jamlab.quasilocalized_modes(p, 20)
first = (~modes.zero).argmax()

figure, axes = plt.subplots(1, 3, figsize=(14, 4.4), layout="constrained")
modes_above = modes.frequencies[first:], modes.participation[first:]
axes[0].plot(*modes_above, "o", color="0.7", label="harmonic modes")
soft.plot(axes[0])
for ax, vectors, name in ((axes[1], modes.vectors[first], "wave"), (axes[2], soft.vectors[0], "soft spot")):
    p.plot(ax, alpha=0.3)
    ax.quiver(*p.positions.T, *vectors.T, color="#D55E00", angles="xy", scale_units="xy", scale=0.15)
    ax.set_title(name)
