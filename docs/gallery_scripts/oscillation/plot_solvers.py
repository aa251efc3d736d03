"""
Three solvers, and the error they estimate
==========================================

Frequency by frequency as in the paper (direct), all relaxations (dense), and a reduced model. The estimate of the error
lies above the difference.
"""

import matplotlib.pyplot as plt
import numpy as np

import jamlab

p = jamlab.pack(n=128, pressure=1e-3, seed=1, ensemble="shear-stabilized")
omega = np.logspace(-6, 2, 33)
direct = jamlab.complex_modulus(p, omega, method="direct")

figure, ax = plt.subplots(figsize=(6, 4.2), layout="constrained")
dense, reduced = jamlab.complex_modulus(p, omega, method="dense"), jamlab.complex_modulus(p, omega, method="reduced")
for s, color in ((dense, "#0072B2"), (reduced, "#D55E00")):
    off = np.maximum(abs(s.storage / direct.storage - 1), abs(s.loss / direct.loss - 1))
    ax.loglog(
        omega, off + 1e-17, "o", color=color, label=f"{s.method}: off from direct ({len(s.spectrum.rates)} elements)"
    )
    ax.loglog(omega, s.error_bound, color=color, label=f"{s.method}: estimate")
ax.set(xlabel="ω τ₁", ylabel="relative error", ylim=(1e-17, 1))
ax.legend(loc="upper center", ncols=2, fontsize=8)
