"""
Power-law drag
==============

G* at a stress amplitude where drag grows as the square root of velocity, by the equivalent linear drag of the paper's
section 7, beside linear drag.
"""

import matplotlib.pyplot as plt
import numpy as np

import jamlab

p = jamlab.pack(n=128, pressure=1e-3, seed=1, ensemble="shear-stabilized")
omega = np.logspace(-6, 2, 41)
figure, ax = plt.subplots(figsize=(6, 4.4), layout="constrained")
for alpha, color in ((1.0, "#0072B2"), (0.5, "#D55E00")):
    film = jamlab.ContactDamping(alpha=alpha)
    jamlab.nonlinear_modulus(p, omega, film, stress=1e-5).plot(ax, color=color, label=f"α = {alpha:g}")
