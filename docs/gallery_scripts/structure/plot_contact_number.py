"""
Excess coordination above onset
===============================

Excess coordination against distance from onset: means of ten packings with standard errors, and a fit of two power laws
as in Boromand et al. (``jamlab.statistics.power_laws``). States are log-spaced near onset (``first_step``). Residuals
are relative to the fit; states with zero excess are included, unjammed states have no coordination number. For large
packings the paper finds the square root alone near onset; packings of 64 disks are small.
"""

import matplotlib.pyplot as plt
import numpy as np

import jamlab
from jamlab.plotting import label_axes
from jamlab.statistics.power_laws import fit_power_law

rows_of_distance, rows_of_excess = [], []
for seed in range(1, 11):
    onset = jamlab.jam(n=64, seed=seed)
    states = list(jamlab.compress(onset, to=onset.phi + 0.09, by="phi", step=0.02, first_step=1e-3))
    rows_of_distance.append([p.phi - onset.phi for p in states])
    rows_of_excess.append([jamlab.contacts(p).z - jamlab.contacts(onset).z for p in states])
distance, excess = np.array(rows_of_distance), np.array(rows_of_excess)  # (packings, distances)

fit = fit_power_law(distance.ravel(), excess.ravel(), (0.5, 1.0))
(root, linear), (root_error, linear_error) = fit.coefficients, fit.coefficients_stderr
law = f"{root:.2f}({100 * root_error:.0f}) Δφ$^{{1/2}}$ + {linear:.1f}({10 * linear_error:.0f}) Δφ"
places, mean, number = distance.mean(axis=0), np.nanmean(excess, axis=0), np.isfinite(excess).sum(axis=0)
error = np.nanstd(excess, axis=0, ddof=1) / number**0.5

figure, ax = plt.subplots(figsize=(5.2, 4), layout="constrained")
ax.loglog(distance.ravel(), excess.ravel(), ".", color="#999999", ms=3, label="states of 10 packings")
ax.errorbar(places, mean, error, fmt="o", color="#0072B2", capsize=2.5, label="means")
at = np.geomspace(1e-3, 0.09, 20)
ax.loglog(at, fit(at), color="#D55E00", label=law)
label_axes(ax, r"distance from onset $\phi - \phi_J$", r"excess coordination $z - z_J$")
ax.legend()
