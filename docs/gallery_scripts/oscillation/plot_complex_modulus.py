"""
G* near jamming
===============

Storage modulus (solid, filled) and loss modulus (dashed, open) at three pressures. The plateau falls with pressure, and
the regime in which both grow as the square root of frequency widens.
"""

import matplotlib.pyplot as plt
import numpy as np

import jamlab

omega = np.logspace(-6, 2, 41)
figure, ax = plt.subplots(figsize=(6, 4.4), layout="constrained")
for pressure, color in zip((1e-2, 1e-3, 1e-4), ("#0072B2", "#D55E00", "#009E73"), strict=True):
    p = jamlab.pack(n=256, pressure=pressure, seed=1, ensemble="shear-stabilized")
    jamlab.complex_modulus(p, omega).plot(ax, color=color, label=f"p = {pressure:g} k")
