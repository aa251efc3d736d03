"""
Spectrum of non-affine displacements
====================================

Power of the non-affine displacements of disks per strain of slow shear, perpendicular to the wavevector and along it.
Black: an elastic sheet under random forces, 1/k². Near onset it is nearly incompressible: long waves are transverse.
See :doc:`/explanation/one_elastic_field`.
"""

import matplotlib.pyplot as plt

import jamlab

packings = [jamlab.pack(512, 1e-3, seed, ensemble="shear-stabilized") for seed in range(1, 13)]
shells = jamlab.displacement_spectrum(packings, 5.0, prestress=False).shells()
figure, ax = plt.subplots(figsize=(6.4, 4.6), layout="constrained")
shells.plot(ax)
ax.plot(shells.k, 11.0 / shells.k**2, color="black", linewidth=1.0, label="$1/k^2$")
ax.set_xlim(0.1, 10)
ax.legend()
