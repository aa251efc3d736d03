"""Force laws of contacts, energy terms with gradient and Hessian; elastic moduli and vibrational modes from them."""
