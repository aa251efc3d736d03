"""
Shear between walls
===================

Left: a slab of disks between two rough walls, with the forces in its contacts after a strain of 0.2 of the cell.
Right: the velocity at each height; dashed: an affine flow.
"""

import matplotlib.pyplot as plt

import jamlab

w = jamlab.with_walls(jamlab.pack(n=128, pressure=1e-2, seed=1))
r = jamlab.quasistatic_shear(w, strain=0.2, strain_step=5e-3, snapshot_every=0.02, walls=True)
print(r.wall_stress[-1], jamlab.slab(r.packing))

figure, (left, right) = plt.subplots(1, 2, figsize=(10.5, 4.6), layout="constrained")
jamlab.contacts(r.packing).plot(left)
r.velocity_profile.plot(right)
