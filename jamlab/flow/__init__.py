"""Packings that flow: protocols in time and strain, beyond the linear response of `jamlab.rheology`."""
