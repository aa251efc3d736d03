"""
Where methods fail
==================

Every cell is one pair of conditions; its colours are the shares of outcomes over several seeds. Every number reported
without a warning was compared with an independent implementation at the final state; a difference would count as a
silent wrong number. In a checkout, ``python -m studies draw
stability`` draws all maps, and ``python -m studies run`` measures them anew.
"""

import matplotlib.pyplot as plt
from matplotlib.backends.backend_agg import FigureCanvasAgg

from studies.reference_data import open_tables
from studies.registry import MAPS


def show(name: str) -> None:
    """Draw one map from the data that ship, and say what it shows."""
    shown = MAPS[name].draw(open_tables())
    canvas = FigureCanvasAgg(shown.figure)
    canvas.draw()
    plt.figure(figsize=shown.figure.get_size_inches()).figimage(canvas.buffer_rgba())
    print(shown.caption)


# %%
# FIRE of LAMMPS decks for droplets: beyond two over the largest frequency of the Hessian it stalls, then diverges.

show("droplet-timestep")

# %%
# Linear response of disks displaced from their minimum: the modulus is correct to 1 %, or jamlab refuses.

show("moved")
