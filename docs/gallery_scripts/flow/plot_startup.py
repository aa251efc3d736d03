"""
Start-up of shear
=================

Shear stress (solid) and its elastic part (dashed) against strain at two rates.
Right: the last packing of the slower run with the forces in its contacts.
"""

import matplotlib.pyplot as plt

import jamlab

p = jamlab.pack(n=64, pressure=1e-2, seed=1)
figure, (left, right) = plt.subplots(1, 2, figsize=(10.5, 4.4), layout="constrained")
for rate in (1e-2, 1e-1):
    r = jamlab.shear(p, rate=rate, strain=1.0)
    r.plot(left, label=rf"rate {rate:g}/$\tau_1$")
    print(r)
    if rate == 1e-2:
        jamlab.contacts(r.packing).plot(right)
