"""
Bond-orientational order
========================

Disks of two sizes are disordered; equal disks crystallise in patches.
"""

import matplotlib.pyplot as plt

import jamlab

figure, axes = plt.subplots(1, 2, figsize=(9, 4.8), layout="constrained")
for ax, ratio in zip(axes, (1.4, 1.0), strict=True):
    p = jamlab.pack(n=128, pressure=1e-2, seed=1, size_ratio=ratio)
    psi = jamlab.hexatic_order(p)
    psi.plot(ax)
    ax.set_title(f"size ratio {ratio}: mean |ψ₆| = {psi.mean_local:.2f}")
