"""Packings from and for other programs: LAMMPS files, MDAnalysis Universes, quantities along trajectories."""
