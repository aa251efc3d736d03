"""
Cells and local packing fraction
================================

Power cells of disks and set-Voronoi cells of droplets; colour: area of a particle over the area of its cell.
"""

import matplotlib.pyplot as plt

import jamlab

figure, axes = plt.subplots(1, 2, figsize=(9, 4.6), layout="constrained")
jamlab.tessellation(jamlab.jam(n=64, seed=1)).plot(axes[0])
jamlab.tessellation(jamlab.jam(model="dp", n=16, seed=1)).plot(axes[1])
