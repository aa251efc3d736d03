"""How uneven contact forces are."""

import numpy as np

import jamlab


def strongest(packing: jamlab.Packing) -> dict[str, float]:
    """The largest contact force over the mean, and the share of contacts with more than twice the mean."""
    force = jamlab.contacts(packing).forces.size
    strong = float(np.mean(force > 2 * force.mean()))
    return {"strongest": force.max() / force.mean(), "strong": strong}
