"""The state: disks or droplets in a periodic box, their neighbours, their files."""
