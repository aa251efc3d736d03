"""Micrographs of droplets: reading, light and noise, annotations, segmentation, walls, shapes, quality, overlays."""
