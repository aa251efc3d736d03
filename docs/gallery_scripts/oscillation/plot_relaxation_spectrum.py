"""
Relaxation spectrum
===================

Maxwell elements of G*: all from the dense solver, and the elements of the reduced model, which have the same sum.
Elements weaker than 10⁻⁶ k are left out: many modes at λτ₁ = 1 do not couple to shear.
"""

import matplotlib.pyplot as plt
import numpy as np

import jamlab

p = jamlab.pack(n=256, pressure=1e-3, seed=1, ensemble="shear-stabilized")
figure, ax = plt.subplots(figsize=(6, 4.2), layout="constrained")
omega = np.logspace(-6, 2, 41)
dense, reduced = jamlab.complex_modulus(p, omega, method="dense"), jamlab.complex_modulus(p, omega, method="reduced")
for s, color in ((dense, "#0072B2"), (reduced, "#D55E00")):
    s.spectrum.plot(ax, color=color, label=f"{s.method}, {len(s.spectrum.rates)} elements")
ax.set_ylim(bottom=1e-6)
