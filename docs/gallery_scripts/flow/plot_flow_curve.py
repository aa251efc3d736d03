r"""
Flow curve and Herschel-Bulkley law
===================================

Steady shear stress over the rate of shear, with standard errors of correlated rows, and the law
:math:`\sigma_y + K \dot\gamma^n` through it.
"""

import matplotlib.pyplot as plt

import jamlab

p = jamlab.pack(n=64, pressure=1e-2, seed=1)
curve = jamlab.flow_curve(p, rates=[1e-3, 3e-3, 1e-2, 3e-2, 1e-1], strain=6.0, discard=0.5)
figure, ax = plt.subplots(figsize=(6, 4.4), layout="constrained")
curve.herschel_bulkley().plot(ax)
print(curve)
