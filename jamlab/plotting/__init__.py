"""Draw arrays with matplotlib: axes, colours, periodic cells, curves on logarithmic axes; knows no packing."""
