"""
Contacts above onset
====================

The excess contact number grows as the square root of the distance to onset; the fit takes distances above 0.01,
below which 64 disks are too few. States are log-spaced near onset
(`nearest`), and the fit is :func:`jamlab.statistics.power_laws.power_law`.
"""

import matplotlib.pyplot as plt
import numpy as np

import jamlab
from jamlab.statistics.power_laws import power_law

distance, excess = [], []
for seed in range(1, 7):
    onset = jamlab.jam(n=64, seed=seed)
    start = jamlab.contacts(onset).z
    for p in jamlab.compress(onset, to=0.95, by="phi", step=0.02, nearest=1e-3):
        distance.append(p.phi - onset.phi)
        excess.append(jamlab.contacts(p).z - start)
distance, excess = np.array(distance), np.array(excess)

figure, ax = plt.subplots(figsize=(5.2, 4), layout="constrained")
jammed, window = excess > 0, distance > 0.01
ax.loglog(distance[jammed], excess[jammed], ".", color="#0072B2", label="states of 6 packings")
fit = power_law(distance[window], excess[window], (0.5,))
line = np.geomspace(1e-3, 0.12, 20)
ax.loglog(line, fit(line), color="#D55E00", label=f"{fit.coefficients[0]:.2f} (φ - φ_J)^0.5")
ax.set(xlabel="φ - φ_J", ylabel="z - z_J")
ax.legend()
