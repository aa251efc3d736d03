"""Draw arrays with matplotlib: axes, colours, periodic cells, curves on logarithmic axes; knows no packing.

Scripts of the gallery and studies take `COLOURS`, `in_unit` and `label_axes`, so that all figures look alike.
"""

from jamlab.plotting.drawable import in_unit as in_unit
from jamlab.plotting.drawable import label_axes as label_axes
from jamlab.plotting.palette import COLOURS as COLOURS
