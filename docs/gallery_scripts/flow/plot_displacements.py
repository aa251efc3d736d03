"""
Displacements in flow
=====================

Left: mean square displacement beyond the affine flow, over the strain between two states. Right: share of particles
that have moved by no more than a tenth of the mean diameter. See :doc:`/how_to/local_strain`.
"""

import matplotlib.pyplot as plt

import jamlab

p = jamlab.pack(n=128, pressure=2e-2, seed=1)
run = jamlab.quasistatic_shear(p, strain=0.4, strain_step=5e-3, snapshot_every=5e-3)

figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.4), layout="constrained")
jamlab.mean_square_displacement(run).plot(left)
jamlab.self_overlap(run, length=0.1).plot(right)
