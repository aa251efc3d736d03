"""Figures of flow in time."""
