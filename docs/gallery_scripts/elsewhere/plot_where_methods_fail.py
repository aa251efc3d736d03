"""
Where methods fail
==================

Every cell is one pair of conditions, filled by the shares of how runs of several seeds ended. Numbers that were
given as right were checked by physics written anew from the definitions, at the state where the run ended; one that
does not follow from it would be a silent wrong number. In a checkout, ``python -m studies draw
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
# FIRE over droplets in plain decks: beyond two over the largest frequency of the Hessian it stalls, then blows up.

show("droplet-timestep")

# %%
# Linear response of disks that were moved off their minimum: the modulus is right to a per cent, or it is refused.

show("moved")
