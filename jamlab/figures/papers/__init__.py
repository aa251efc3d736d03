"""Redraw every figure of both papers from tables of an ensemble, with a verdict on each number."""
