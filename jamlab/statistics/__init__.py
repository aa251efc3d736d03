"""Intervals, power laws and published numbers; knows no packing."""
