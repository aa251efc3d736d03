"""
Pair correlation and spectral density
=====================================

Left: pair correlation of disks of two sizes. Right: structure factor of the centres and spectral density of the covered
area over the wavenumber. At long waves the density of centres fluctuates, the covered area hardly does.
See :doc:`/how_to/structure`.
"""

import matplotlib.pyplot as plt

import jamlab
from jamlab.plotting import in_unit

packings = [jamlab.pack(n=512, pressure=1e-3, seed=seed) for seed in range(1, 6)]
figure, axes = plt.subplots(1, 2, figsize=(10, 4.2), layout="constrained")
jamlab.pair_correlation(packings, 4.0).plot(axes[0])
jamlab.structure_factor(packings, 30.0).plot(axes[1], color="#999999", label="centres, $S(k)$")
jamlab.spectral_density(packings, 30.0).plot(axes[1], label=in_unit(r"covered area, $\chi_V(k)$", "d²"))
axes[1].set_ylabel(r"$S(k)$ and $\chi_V(k)$")
