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

from studies.failure.map import default_distance, failure_figure
from studies.registry import MAPS


def show(name):
    """Draw one map from the data that ship, and say where the default lies in it."""
    table = MAPS[name].table()
    drawn = failure_figure(MAPS[name], table.rows)
    canvas = FigureCanvasAgg(drawn)
    canvas.draw()
    plt.figure(figsize=drawn.get_size_inches()).figimage(canvas.buffer_rgba())
    print(f"{MAPS[name].meaning}\ndefault: {default_distance(MAPS[name], table.rows) or 'none'}\nmade {table.made}")


# %%
# FIRE over droplets in plain decks: beyond two over the largest frequency of the Hessian it stalls, then blows up.

show("droplet-timestep")

# %%
# Linear response of disks that were moved off their minimum: the modulus is right to a per cent, or it is refused.

show("moved")
