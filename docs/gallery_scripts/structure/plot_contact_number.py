"""
Contacts above onset
====================

The excess contact number over the distance to onset. States are log-spaced near onset (``nearest``), and the fit is a
sum of two power laws as in Boromand et al., by ``jamlab.statistics.power_laws``, which weighs relative errors. Packings
of 64 disks are small: the paper finds the square root alone near onset in the limit of large ones.
"""

import matplotlib.pyplot as plt
import numpy as np

import jamlab
from jamlab.statistics.power_laws import power_law

distance, excess = [], []
for seed in range(1, 7):
    onset = jamlab.jam(n=64, seed=seed)
    start = jamlab.contacts(onset).z
    for p in jamlab.compress(onset, to=0.95, by="phi", step=0.02, first_step=1e-3):
        distance.append(p.phi - onset.phi)
        excess.append(jamlab.contacts(p).z - start)
distance, excess = np.array(distance), np.array(excess)

figure, ax = plt.subplots(figsize=(5.2, 4), layout="constrained")
jammed = excess > 0
ax.loglog(distance[jammed], excess[jammed], ".", color="#0072B2", label="states of 6 packings")
fit = power_law(distance[jammed], excess[jammed], (0.5, 1.0))
line = np.geomspace(1e-3, 0.12, 20)
ax.loglog(line, fit(line), color="#D55E00", label="{:.1f} Δφ$^{{1/2}}$ + {:.1f} Δφ".format(*fit.coefficients))
ax.set(xlabel="Δφ = φ - φ$_J$", ylabel="z - z$_J$")
ax.legend()
