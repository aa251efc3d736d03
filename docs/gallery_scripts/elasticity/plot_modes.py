"""
Soft modes
==========

The lowest eigenmodes of the Hessian. Two cost nothing, the translations, and two more for every rattler; then come
modes that are spread over the whole packing.
"""

import matplotlib.pyplot as plt

import jamlab

p = jamlab.pack(n=128, pressure=1e-3, seed=2)
zero = jamlab.count_zero_modes(p)
modes = jamlab.lowest_modes(p, 40)
print(f"{zero} modes without stiffness, {jamlab.contacts(p).rattlers.sum()} rattlers")

figure, axes = plt.subplots(1, 2, figsize=(10, 4.4), layout="constrained")
modes.plot(axes[0])
p.plot(axes[1], alpha=0.3)
softest = modes.vectors[zero]
axes[1].quiver(*p.positions.T, *softest.T, color="#D55E00", angles="xy", scale_units="xy", scale=0.15)
axes[1].set_title(f"softest of the others, eigenvalue {modes.eigenvalues[zero]:.2g} k")
