"""The same disks in other codes: energy, forces and stress at fixed coordinates, minima, and what they cost."""
