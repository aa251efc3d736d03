"""Figures of Baumgarten & Tighe, Soft Matter 13, 8368 (2017)."""
