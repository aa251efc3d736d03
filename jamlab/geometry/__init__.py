"""Contacts, areas, shapes, packing fractions, cells and voids of packings."""
