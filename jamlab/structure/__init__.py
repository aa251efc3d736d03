"""How particles are arranged: pair correlations, structure factors and spectra of the area that they cover."""
