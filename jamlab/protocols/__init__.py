"""How packings are made: minima, onset, sweeps, target pressure, droplets in the place of disks."""
