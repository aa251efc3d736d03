"""
Figures of the papers
=====================

Two of them, from the reference data that ship with jamlab, with the verdict on each number. ``jamlab figure all`` draws
every one.
"""

import matplotlib.pyplot as plt
from matplotlib.backends.backend_agg import FigureCanvasAgg

from jamlab.figures.papers.gallery import draw
from jamlab.figures.papers.tables import reference_tables

for name in ("boromand-6", "baumgarten-3"):
    drawing = draw(name, reference_tables())
    canvas = FigureCanvasAgg(drawing.figure)
    canvas.draw()
    plt.figure(figsize=drawing.figure.get_size_inches()).figimage(canvas.buffer_rgba())
    for claim in drawing.claims:
        print(f"{name}: {claim.quantity}: {claim.value:.3g}, paper {claim.paper:g}: {claim.verdict}")
