"""Pictures of packings and tables; runs no LAMMPS."""
