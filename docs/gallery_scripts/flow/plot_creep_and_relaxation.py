"""
Creep and stress relaxation
===========================

Left: strain over stress after a step of stress. Right: stress over strain after a step of strain. Both are linear here,
and end at 1/G and at G of the packing (dotted).
"""

import matplotlib.pyplot as plt

import jamlab

p = jamlab.pack(n=64, pressure=1e-2, seed=1, ensemble="shear-stabilized")
g = jamlab.shear_modulus(p, direction="simple")
figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.2), layout="constrained")
jamlab.creep(p, stress=1e-7, duration=1e3).plot(left)
jamlab.relax_stress(p, strain=1e-6, duration=1e3).plot(right)
left.axhline(1 / g, color="black", linestyle=":")
right.axhline(g, color="black", linestyle=":")
