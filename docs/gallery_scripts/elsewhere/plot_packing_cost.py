"""
CPU time of packings
====================

CPU time of an onset, of a packing at a pressure and of a minimum against the number of particles, in jamlab and in
other codes. In a checkout, ``python -m studies draw packing-generation`` draws the same.
"""

import matplotlib.pyplot as plt
from matplotlib.backends.backend_agg import FigureCanvasAgg

from studies.pages import draw
from studies.reference_data import open_tables

shown = draw("packing-generation", open_tables())
canvas = FigureCanvasAgg(shown.figure)
canvas.draw()
plt.figure(figsize=shown.figure.get_size_inches()).figimage(canvas.buffer_rgba())
print(shown.caption)
