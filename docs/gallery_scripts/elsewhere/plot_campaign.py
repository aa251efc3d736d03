"""
A campaign, with error bars
===========================

Coordination number and shear modulus of disks against the distance from onset: means over packings with 95 % confidence
intervals (bootstrap). A campaign is one file; run again, it makes only the missing packings.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np

import jamlab
from jamlab.plotting import COLOURS, in_unit, label_axes

CAMPAIGN = """
name = "gallery"

[[sweep]]
name = "disks"
model = "sp"
n = [16, 32]
seeds = 8
ensemble = "shear-stabilized"
compress = { to = 0.92, step = 0.02, first_step = 1e-3 }
observables = ["states"]
"""

with TemporaryDirectory() as folder:
    path = Path(folder) / "gallery.toml"
    path.write_text(CAMPAIGN)
    campaign = jamlab.open_campaign(path)
    print(campaign.run(1))
    figure, axes = plt.subplots(1, 2, figsize=(10.5, 4.4), layout="constrained")
    labels = {"z": "coordination number $z$", "g": in_unit("shear modulus $G$", "k")}
    for ax, (quantity, label) in zip(axes, labels.items(), strict=True):
        ax.set_prop_cycle(color=COLOURS)
        means = campaign.aggregate([quantity], along="d_rho", bins=np.geomspace(1e-3, 0.1, 6))
        for n, curve in means.groupby("n"):
            errors = [curve[quantity] - curve[f"{quantity}_low"], curve[f"{quantity}_high"] - curve[quantity]]
            ax.errorbar(curve["d_rho"], curve[quantity], errors, marker="o", capsize=2.5, label=f"N = {n}")
        label_axes(ax, r"distance from onset $\rho - \rho_J$", label)
        ax.set_xscale("log")
        ax.xaxis.set_minor_formatter("")  # labels of minor ticks would overlap
        ax.legend()
