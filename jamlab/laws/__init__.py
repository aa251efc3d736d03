"""Force laws of contacts: what every law says, its parameters, and the laws by their names."""
