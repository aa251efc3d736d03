"""Figures of Baumgarten and Tighe from our own packings."""
