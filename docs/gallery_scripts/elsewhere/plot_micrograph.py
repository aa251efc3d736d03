"""
A micrograph, measured
======================

A picture of droplets with uneven light and noise, rendered from a packing so that the truth is known, and what is
recognised in it.
"""

import matplotlib.pyplot as plt

import jamlab

*_, dense = jamlab.compress(jamlab.jam(model="dp", n=32, seed=1), to=0.94, step=0.03)
picture = jamlab.synthetic_micrograph(dense, 540, blur=1.0, noise=0.05, light=0.6, seed=1)
m = jamlab.micrograph(picture, pixel=dense.box[0, 0] / 540)

figure, axes = plt.subplots(1, 2, figsize=(10, 5), layout="constrained")
axes[0].imshow(picture, cmap="gray")
axes[0].set_axis_off()
m.plot(axes[1])
rho, z = jamlab.packing_fraction(dense), jamlab.contacts(dense).z
seen = m.numbers["z"]
print(f"{m.quality}: rho = {m.rho:.3f}, truth {rho:.3f}; z = {m.z:.2f} ± {seen.uncertainty:.2f}, truth {z:.2f}")
