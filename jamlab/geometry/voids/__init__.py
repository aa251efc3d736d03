"""Voids: regions that no particle covers, with exact boundaries on the torus."""
