"""
Dilatancy
=========

Disks sheared at two constant pressures. Left: growth of the area of the box. Right: shear stress over pressure.
"""

import matplotlib.pyplot as plt

import jamlab

figure, (left, right) = plt.subplots(1, 2, figsize=(10.5, 4.2), layout="constrained")
for pressure in (1e-3, 1e-2):
    p = jamlab.pack(n=64, pressure=pressure, seed=1)
    r = jamlab.quasistatic_shear(p, strain=0.2, strain_step=5e-3, pressure="constant")
    left.plot(r.strain, r.dilation, label=f"p = {pressure:g} k")
    right.plot(r.strain, r.stress / pressure, label=f"p = {pressure:g} k")
left.set(xlabel=r"strain $\gamma$", ylabel=r"dilation $A/A_0 - 1$")
right.set(xlabel=r"strain $\gamma$", ylabel=r"$\sigma/p$")
left.legend()
