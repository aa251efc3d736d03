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

figure, axes = plt.subplots(2, 1, figsize=(11, 9), layout="constrained")
for ax, name in zip(axes, ("boromand-6", "baumgarten-3"), strict=True):
    drawing = draw(name, reference_tables())
    canvas = FigureCanvasAgg(drawing.figure)
    canvas.draw()
    ax.imshow(canvas.buffer_rgba())
    ax.set_axis_off()
    for claim in drawing.claims:
        print(f"{name}: {claim.quantity}: {claim.value:.3g}, paper {claim.paper:g}: {claim.verdict}")
