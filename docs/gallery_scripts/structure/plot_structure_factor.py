"""
Pair correlation and spectral density
=====================================

Distances between disks of two sizes, and what part of the area they cover at every wavelength: centres fluctuate at
long waves, the covered area hardly does.
"""

import matplotlib.pyplot as plt

import jamlab

packings = [jamlab.pack(n=512, pressure=1e-3, seed=seed) for seed in range(1, 6)]
figure, axes = plt.subplots(1, 2, figsize=(10, 4.2), layout="constrained")
jamlab.pair_correlation(packings, 4.0).plot(axes[0])
jamlab.structure_factor(packings, 30.0).plot(axes[1], color="#999999", label="centres, S(k)")
jamlab.spectral_density(packings, 30.0).plot(axes[1], label="area, χ(k) in d²")
axes[1].set_ylabel("S(k) and χ(k)")
