"""Figures of Boromand et al. from our own packings."""
