"""Micrographs of droplets: reading, light and noise, segmentation, walls, shapes, quality, overlays."""
