"""
Force network
=============

Lines connect the centres of particles in contact; their width is proportional to the force. Grey: rattlers.
"""

import matplotlib.pyplot as plt

import jamlab

figure, axes = plt.subplots(1, 2, figsize=(9, 5.2), layout="constrained")
for ax, pressure in zip(axes, (1e-2, 1e-4), strict=True):
    p = jamlab.pack(n=128, pressure=pressure, seed=1)
    network = jamlab.contacts(p)
    network.plot(ax)
    ax.set_title(f"p = {pressure:g} k, z = {network.z:.2f}, {network.rattlers.sum()} rattlers")

# %%
# Forces themselves are arrays, with the gap of every contact.

force = network.forces.size
print(f"strongest over mean force: {force.max() / force.mean():.2f}")
