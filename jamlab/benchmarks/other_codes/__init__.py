"""The same disks in other codes: forces, minima, time on one core."""
