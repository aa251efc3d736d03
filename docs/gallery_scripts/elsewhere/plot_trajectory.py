"""
Along a trajectory with MDAnalysis
==================================

A sweep as a Universe, and quantities of its frames.
"""

import matplotlib.pyplot as plt

import jamlab
from jamlab.plotting import label_axes

onset = jamlab.jam(n=64, seed=1)
u = jamlab.universe([onset, *jamlab.compress(onset, to=0.95, step=0.01)])
print(u, u.trajectory.n_frames, "frames")
a = jamlab.measure(jamlab.from_universe(u), ["rho", "psi_6", "shape_factor"])

figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
axes[0].plot(a["rho"], a["psi_6"], "o-", color="#0072B2")
label_axes(axes[0], "true packing fraction ρ", "mean |ψ₆|")
axes[1].plot(a["rho"], a["shape_factor"], "o-", color="#D55E00")
label_axes(axes[1], "true packing fraction ρ", r"mean shape factor $\mathcal{A}$")
