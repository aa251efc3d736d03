"""Charts of what jamlab's methods cost, how wrong they are, and where they break."""
