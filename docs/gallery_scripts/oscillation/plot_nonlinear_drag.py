"""
Power-law drag
==============

G* for linear drag, and at a stress amplitude for drag that grows as the square root of velocity: equivalent linear drag
of the paper's section 7. Grey: outside the range in which the approximation agrees with the power law to 10 %
(see :doc:`/explanation/quantities`).
"""

import matplotlib.pyplot as plt
import numpy as np

import jamlab

p = jamlab.pack(n=128, pressure=1e-3, seed=1, ensemble="shear-stabilized")
omega = np.logspace(-7, 0, 43)
figure, ax = plt.subplots(figsize=(6, 4.4), layout="constrained")
jamlab.complex_modulus(p, omega).plot(ax, color="#0072B2", label="α = 1")

film = jamlab.nonlinear_modulus(p, omega, jamlab.ContactDamping(alpha=0.5), stress=1e-5)
x = omega * film.tau
for name, values, limit, style in (("G'", film.storage, 3.0, "o-"), ("G''", film.loss, 30.0, "s--")):
    shown, valid = x < 30, (x > 1) & (x < limit)
    ax.plot(omega[shown], values[shown], style[1:], color="#BBBBBB", zorder=0)
    ax.plot(omega[valid], values[valid], style, color="#D55E00", markersize=4, label=f"${name}_{{xy}}$  α = 0.5")
ax.legend()
