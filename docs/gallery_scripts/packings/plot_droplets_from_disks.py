"""
Droplets from disks
===================

Up to ρ ≈ 0.88 disks and droplets agree, and disks are cheaper. Then droplets replace the disks, with the same centres,
areas and packing fraction.
"""

import matplotlib.pyplot as plt

import jamlab

onset = jamlab.jam(n=32, seed=1)
*_, disks = jamlab.compress(onset, to=0.88, step=0.02)
droplets = jamlab.droplets_from_disks(disks)
*_, dense = jamlab.compress(droplets, to=0.96, step=0.02)
print(droplets.provenance["handover"])

figure, axes = plt.subplots(1, 3, figsize=(12, 4.3), layout="constrained")
for ax, p in zip(axes, (disks, droplets, dense), strict=True):
    p.plot(ax)
    ax.set_title(f"ρ = {jamlab.packing_fraction(p):.3f}, z = {jamlab.contacts(p).z:.2f}")
