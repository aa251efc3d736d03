"""Large packings for timing: a small one side by side."""

import numpy as np


def tiled(packing, times):
    """The packing repeated times x times: as many different local surroundings as one, but the size of many."""
    moves = np.stack(np.meshgrid(np.arange(times), np.arange(times)), axis=-1).reshape(-1, 2) @ packing.box
    state = {
        "positions": (packing.positions[None] + moves[:, None]).reshape(-1, 2),
        "box": packing.box * times,
    }
    if packing.model == "sp":
        return packing.with_state(**state, diameters=np.tile(packing.diameters, times**2))
    vertices = np.tile(np.diff(packing.offsets), times**2)
    params = packing.params | {"a0": np.tile(packing.params["a0"], times**2)}
    return packing.with_state(**state, offsets=np.concatenate([[0], np.cumsum(vertices)]), params=params)
