"""LAMMPS: one session, the decks it reads, MPI ranks, the installation around it."""
