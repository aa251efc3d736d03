"""
Figures of Boromand et al., with verdicts
=========================================

Coordination, moduli, shapes and voids against packing fraction, from the reference data of jamlab, with the verdict on
each number. ``python -m studies draw papers`` draws every figure and writes them on one page.
"""

import matplotlib.pyplot as plt
from matplotlib.backends.backend_agg import FigureCanvasAgg

from studies.pages import draw
from studies.reference_data import open_tables

tables = open_tables()


def show(name: str) -> None:
    """Draw one figure and print its verdicts."""
    drawing = draw(name, tables)
    canvas = FigureCanvasAgg(drawing.figure)
    canvas.draw()
    plt.figure(figsize=drawing.figure.get_size_inches()).figimage(canvas.buffer_rgba())
    for claim in drawing.claims:
        print(claim.line)


# %%
# Coordination and shear modulus against distance from onset.

show("boromand-6")

# %%
# Shapes and packing fractions.

show("boromand-4")

# %%
# Voids.

show("boromand-8")

# %%
# Width of the distribution of onsets against the number of particles.

show("boromand-10")
