"""
Cost against error
==================

Error against CPU time of each method, as its own parameter varies; ten packings or more. Lines: mean errors; bars: 10
to 90 % of the packings; ring: default of jamlab. In a checkout, ``python -m studies draw
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
# Droplets: first-order methods converge slowly; L-BFGS preconditioned with the Hessian does not. Open marks: some
# packings ended above the tolerance.

show("droplet-minimisers")

# %%
# The shear modulus, including the minimisation. Finite strain is limited by rounding at small strains and by contact
# changes at large strains; linear response is not.

show("shear-modulus")

# %%
# Overdamped start-up of shear: tolerance of a step, and residual of the solver of velocities. The default residual adds
# no error beyond the default tolerance.

show("flow-steps")

# %%
# A mean over packings of disks against number and size of packings. φ and z depend on N: larger packings have a smaller
# error at equal time, and more small packings do not help. G scatters from packing to packing.

show("ensemble-means")

# %%
# The true packing fraction of disks: overlaps of pairs are exact until three disks overlap in one point.

show("packing-fraction")

# %%
# Vertices of droplets: difference of the default numbers, 12 and 17, from smooth outlines.

show("droplet-vertices")

# %%
# The shear modulus of droplets, near onset and dense.

show("droplet-modulus")
