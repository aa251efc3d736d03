"""
Non-affine motion
=================

Under shear, particles near jamming swirl instead of following the strain. Left: displacements per strain, less the
affine part. Right: normal, tangential and non-affine displacements.
"""

import matplotlib.pyplot as plt

import jamlab

p = jamlab.pack(n=128, pressure=1e-3, seed=1, ensemble="shear-stabilized")
tensor = jamlab.elastic_tensor(p)
swirl = tensor.displacements[:, :, 0, 1]

figure, axes = plt.subplots(1, 2, figsize=(10, 4.4), layout="constrained")
p.plot(axes[0], alpha=0.3)
axes[0].quiver(*p.positions.T, *swirl.T, color="#D55E00", angles="xy", scale_units="xy", scale=3)
axes[0].set_title("displacement per strain, arrows scaled by 1/3")
jamlab.nonaffine_response(p).plot(axes[1])
