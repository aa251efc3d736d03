"""Figures of droplets beyond the two papers."""
