"""
Disks and droplets
==================

The two models at the same true packing fraction. Disks overlap; droplets keep their area and change their shape.
"""

import matplotlib.pyplot as plt

import jamlab

figure, axes = plt.subplots(1, 2, figsize=(9, 4.6), layout="constrained")
disks, droplets = jamlab.jam(n=16, seed=1), jamlab.jam(model="dp", n=16, seed=1)
for ax, onset, name in zip(axes, (disks, droplets), ("soft disks", "deformable droplets"), strict=True):
    *_, dense = jamlab.compress(onset, to=0.95, step=0.03)
    dense.plot(ax)
    ax.set_title(f"{name}: φ = {dense.phi:.3f}, ρ = {jamlab.packing_fraction(dense):.3f}")
