"""Figures of Boromand et al. and of Baumgarten & Tighe, drawn from tables of our own packings; runs no physics."""
