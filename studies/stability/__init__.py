"""Stability maps: where a method converges, stalls or fails."""
