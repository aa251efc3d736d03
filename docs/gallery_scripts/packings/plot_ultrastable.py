"""
Ultrastable packings: swapped sizes
===================================

Disks that exchange their sizes find minima of much lower energy than a quench. See :doc:`/how_to/ultrastable`.
"""

import matplotlib.pyplot as plt

import jamlab
from jamlab.plotting import COLOURS, in_unit, label_axes

# %%
# Swap Monte Carlo at falling temperature. Slower cooling finds lower minima.

start = jamlab.pack(n=100, phi=0.92, seed=6, sizes="lognormal:0.2")
runs = {sweeps: jamlab.swap_sizes(start, sweeps=sweeps) for sweeps in (100, 1000, 4000)}
runs[4000].plot()

# %%
# The same sizes, quenched and swapped. Colour: diameter.

figure, axes = plt.subplots(1, 2, figsize=(12, 5.4), layout="constrained")
for ax, (name, p) in zip(axes, {"quenched": start, "swapped": runs[4000].packing}.items(), strict=True):
    p.plot(ax)
    ax.set_title(f"{name}: $G$ = {jamlab.shear_modulus(p):.2f} $k$, $p$ = {jamlab.evaluate(p).pressure:.3f} $k$")

# %%
# Decompressed, swapped packings jam at a larger packing fraction.

pressures = [1e-2, 1e-3, 1e-4]
made = {"quenched": start} | {f"{sweeps} sweeps": found.packing for sweeps, found in runs.items()}
made |= {"transient radii": jamlab.relax_radii(start), "thermal": jamlab.anneal(start, [1e-2, 1e-6], 200).packing}
figure, ax = plt.subplots(figsize=(6.4, 4.6), layout="constrained")
ax.set_prop_cycle(color=COLOURS)
for name, p in made.items():
    phi = []
    for pressure in pressures:
        p = jamlab.decompress(p, pressure)
        phi.append(p.phi)
    ax.semilogy(phi, pressures, "o-", label=name)
label_axes(ax, r"nominal packing fraction $\phi$", in_unit("pressure $p$", "k"))
ax.legend()
