"""
Soft modes
==========

The lowest eigenmodes of the Hessian. Zero modes are the two translations and two for every rattler. The next modes
extend over the whole packing.
"""

import matplotlib.pyplot as plt

import jamlab

p = jamlab.pack(n=128, pressure=1e-3, seed=2)
zero = jamlab.count_zero_modes(p)
modes = jamlab.lowest_modes(p, 40)
print(f"{zero} zero modes, {jamlab.contacts(p).rattlers.sum()} rattlers")

figure, axes = plt.subplots(1, 2, figsize=(10, 4.4), layout="constrained")
modes.plot(axes[0])
p.plot(axes[1], alpha=0.3)
softest = modes.vectors[zero]
axes[1].quiver(*p.positions.T, *softest.T, color="#D55E00", angles="xy", scale_units="xy", scale=0.15)
axes[1].set_title(f"lowest mode above zero: eigenvalue {modes.eigenvalues[zero]:.2g} k")
