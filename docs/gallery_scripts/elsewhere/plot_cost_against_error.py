"""
Cost against error
==================

What every method costs, along its own parameter, and how wrong it is, over ten packings or more: lines are mean errors,
bars 10 to 90 % of the packings, a ring is what jamlab does by default. In a checkout, ``python -m studies draw
speed-accuracy`` draws all of them, and ``python -m studies run`` measures them anew.
"""

import matplotlib.pyplot as plt
from matplotlib.backends.backend_agg import FigureCanvasAgg

from studies.reference_data import open_tables
from studies.registry import CHARTS


def show(name: str) -> None:
    """Draw one chart from the data that ship, and say what its errors are measured against."""
    shown = CHARTS[name].draw(open_tables())
    canvas = FigureCanvasAgg(shown.figure)
    canvas.draw()
    plt.figure(figsize=shown.figure.get_size_inches()).figimage(canvas.buffer_rgba())
    print(shown.caption)


# %%
# Droplets: first-order methods crawl along their flats; steps preconditioned by the Hessian do not. Open marks: some
# packings ended above the tolerance.

show("droplet-minimisers")

# %%
# The shear modulus, with the minimisation before it: linear response works where finite strain meets rounding at one
# end and changing contacts at the other.

show("shear-modulus")

# %%
# Start-up of shear without inertia: the tolerance of a step, and the residual of the solver of velocities, whose
# default adds no error that the default tolerance has not.

show("flow-steps")

# %%
# A mean over packings of disks: how many of which size. φ and z depend on N, so larger packings err less for the same
# time, and more packings of a small size do not help. G scatters from packing to packing.

show("ensemble-means")

# %%
# The true packing fraction of disks: pairs of overlaps suffice until three disks overlap in a point.

show("packing-fraction")

# %%
# Vertices of droplets: what the default numbers, 12 and 17, differ from smooth outlines by.

show("droplet-vertices")

# %%
# The shear modulus of droplets, near onset and dense.

show("droplet-modulus")
