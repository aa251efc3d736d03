"""
Oscillations beyond linear response
===================================

Stress against strain in the last cycle at two amplitudes (Lissajous figures). At the small amplitude the loop is an
ellipse. At the large amplitude contacts change in every cycle. The area of a loop is the dissipated energy.
"""

import matplotlib.pyplot as plt

import jamlab

p = jamlab.pack(n=64, pressure=1e-2, seed=1)
figure, axes = plt.subplots(1, 2, figsize=(10, 4.2), layout="constrained")
for ax, amplitude in zip(axes, (1e-3, 1e-2), strict=True):
    o = jamlab.oscillate(p, omega=1.0, amplitude=amplitude, points_per_cycle=64)
    o.plot(ax)
    third = o.third_over_first
    print(f"amplitude {amplitude:g}: G' {o.storage:.4g} k, G'' {o.loss:.4g} k, third harmonic over first {third:.2g}")
