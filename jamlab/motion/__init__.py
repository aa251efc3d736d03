"""Motion of particles between states: local strain and D2min, mean square displacement, overlap."""
