"""
Drag laws
=========

One packing with three drag laws: normal and tangential contact damping, normal damping only, and Stokes drag.
"""

import matplotlib.pyplot as plt
import numpy as np

import jamlab

p = jamlab.pack(n=256, pressure=1e-3, seed=1, ensemble="shear-stabilized")
omega = np.logspace(-6, 2, 41)
laws = {
    "contacts, β = 1": jamlab.ContactDamping(beta=1.0),
    "contacts, β = 0": jamlab.ContactDamping(beta=0.0),
    "Stokes": jamlab.StokesDrag(eta_f=1.0),
}
figure, ax = plt.subplots(figsize=(6, 4.4), layout="constrained")
for (name, law), color in zip(laws.items(), ("#0072B2", "#D55E00", "#009E73"), strict=True):
    jamlab.complex_modulus(p, omega, law).plot(ax, color=color, label=name)
