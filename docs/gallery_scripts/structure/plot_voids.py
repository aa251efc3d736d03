"""
Voids
=====

Voids, coloured by the number of particles around them, and the share of each number.
"""

import matplotlib.pyplot as plt

import jamlab

p = jamlab.jam(n=128, seed=1)
backbone = jamlab.remove_rattlers(p)
found = jamlab.voids(backbone)

figure, axes = plt.subplots(1, 2, figsize=(10, 4.6), layout="constrained", width_ratios=(1.3, 1))
found.plot(axes[0])
jamlab.void_statistics(found).plot(axes[1])

# %%
# Their areas add up to (1 − ρ) times the area of the box.

print(found.area.sum() / p.area, 1 - jamlab.packing_fraction(backbone))
