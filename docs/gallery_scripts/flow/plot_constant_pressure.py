"""
Dilatancy
=========

Disks sheared quasi-statically at two constant pressures. Left: relative change of the area of the box. Right: shear
stress over pressure.
"""

import matplotlib.pyplot as plt

import jamlab
from jamlab.plotting import COLOURS, label_axes

figure, (left, right) = plt.subplots(1, 2, figsize=(10.5, 4.2), layout="constrained")
for pressure, color in zip((1e-3, 1e-2), COLOURS, strict=False):
    p = jamlab.pack(n=64, pressure=pressure, seed=1)
    r = jamlab.quasistatic_shear(p, strain=0.2, strain_step=5e-3, pressure="constant")
    left.plot(r.strain, r.dilation, color=color, label=f"p = {pressure:g} k")
    right.plot(r.strain, r.stress / pressure, color=color)
label_axes(left, r"strain $\gamma$", r"dilation $A/A_0 - 1$")
label_axes(right, r"strain $\gamma$", r"stress ratio $\sigma/p$")
for ax in (left, right):
    ax.locator_params(axis="x", nbins=5)  # labels of more ticks would overlap
left.legend()
