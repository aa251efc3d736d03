"""
Figures of Baumgarten & Tighe, with verdicts
=============================================

The complex shear modulus near jamming, from the reference data that ship with jamlab, and the verdict
on each number. ``python -m studies draw papers`` draws every figure and writes them on one page.
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
# G* at several pressures, and all of them on one curve.

show("baumgarten-3")

# %%
# Weak or no tangential damping; the last panel shows viscosities.

show("baumgarten-4")

# %%
# Relative displacements in quasi-static shear.

show("baumgarten-5")
