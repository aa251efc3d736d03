"""
Three solvers of the complex modulus
====================================

Difference of the dense and the reduced solver from the direct solution at every frequency. Lines: estimated error
bounds.
"""

import matplotlib.pyplot as plt
import numpy as np

import jamlab
from jamlab.plotting import label_axes

p = jamlab.pack(n=128, pressure=1e-3, seed=1, ensemble="shear-stabilized")
omega = np.logspace(-6, 2, 33)
direct = jamlab.complex_modulus(p, omega, method="direct")

figure, ax = plt.subplots(figsize=(6, 4.2), layout="constrained")
dense, reduced = jamlab.complex_modulus(p, omega, method="dense"), jamlab.complex_modulus(p, omega, method="reduced")
for s, color in ((dense, "#0072B2"), (reduced, "#D55E00")):
    off = np.maximum(abs(s.storage / direct.storage - 1), abs(s.loss / direct.loss - 1))
    name = f"{s.method} ({len(s.spectrum.rates)} elements)"
    ax.loglog(omega, off + 1e-17, "o", color=color, label=f"{name}: difference from direct")
    ax.loglog(omega, s.error_bound, color=color, label=f"{s.method}: error bound")
label_axes(ax, r"angular frequency $\omega\,\tau_1$", "relative error")
ax.set_ylim(1e-17, 1e-8)
ax.legend(loc="upper right", fontsize=8)
