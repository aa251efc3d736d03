"""Laws of the outline of droplets: energies of one droplet alone, beside its line tension and area elasticity."""
