"""
Limit cycle
===========

Cyclic quasi-static shear of disks until a state returns. Left: stress against strain; grey: the transient. Right: mean
displacement of the particles in each cycle. See :doc:`/how_to/cyclic_shear`.
"""

import matplotlib.pyplot as plt

import jamlab

p = jamlab.pack(n=32, pressure=1e-2, seed=1)
r = jamlab.quasistatic_shear(p, strain=[0.06, -0.06, 0.06], strain_step=4e-3, cycles=20)
cycle = r.limit_cycle
assert cycle is not None, r.state  # the packing came back
print(cycle)
print(cycle.hysterons.to_dataframe())

figure, (left, right) = plt.subplots(1, 2, figsize=(10.5, 4.4), layout="constrained")
r.plot(left)
r.cycles.plot(right)
