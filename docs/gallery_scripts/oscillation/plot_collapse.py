"""
Bring pressures onto one curve
==============================

Rescaled with the exponents that fit best, without pre-stress as in the paper.
"""

import matplotlib.pyplot as plt
import numpy as np

import jamlab

pressures, omega = [1e-2, 1e-3, 1e-4], np.logspace(-6, 2, 41)
spectra = []
for pressure in pressures:
    packings = [jamlab.pack(n=128, pressure=pressure, seed=seed) for seed in (1, 2, 3)]
    spectra.append([jamlab.complex_modulus(p, omega, prestress=False) for p in packings])
c = jamlab.scaling_collapse(pressures, spectra)
print(c.exponents)
figure, ax = plt.subplots(figsize=(6, 4.6), layout="constrained")
c.plot(ax)
