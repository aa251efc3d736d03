"""
Local strain of plastic events
==============================

Left: D²min of each particle in the step of quasi-static shear with the largest D²min, on a logarithmic scale.
Right: mean and largest D²min of each step; plastic events stand out by orders of magnitude.
See :doc:`/how_to/local_strain`.
"""

import matplotlib.pyplot as plt

import jamlab

p = jamlab.pack(n=256, pressure=2e-2, seed=1)
run = jamlab.quasistatic_shear(p, strain=0.06, strain_step=2e-3, snapshot_every=2e-3)
steps = jamlab.local_strain(run)
worst = steps[int(steps.largest.argmax())]
print(f"{worst.participation:.1f} particles take part; {len(jamlab.t1_events(run))} T1 events")

figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.8), layout="constrained")
worst.plot(left)
steps.plot(right)
