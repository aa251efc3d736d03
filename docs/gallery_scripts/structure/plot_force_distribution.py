"""
Distribution of contact forces
==============================

Contact forces over their mean, for ten packings at one pressure.
"""

import matplotlib.pyplot as plt
import numpy as np

import jamlab
from jamlab.plotting import label_axes

forces = []
for seed in range(1, 11):
    size = jamlab.contacts(jamlab.pack(n=128, pressure=1e-3, seed=seed)).forces.size
    forces.append(size / size.mean())

figure, ax = plt.subplots(figsize=(5, 3.6), layout="constrained")
ax.hist(np.concatenate(forces), bins=np.linspace(0, 4, 33).tolist(), density=True, color="#0072B2")
label_axes(ax, "contact force over its mean", "probability density")
ax.set_yscale("log")
