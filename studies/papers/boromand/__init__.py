"""Figures of Boromand et al., Soft Matter 15, 5854 (2019)."""
