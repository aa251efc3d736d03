"""Means of an ensemble to a given error: the cheapest packings that give them, planned from a measured table."""
