"""Made-up tables of droplets of several force laws, in which known laws hold: for tests of the figures beyond-*."""

from itertools import product

import numpy as np
import pandas as pd

from studies import ensemble_tables as reduced
from studies.beyond.droplet_voids import three_disks

SEEDS = range(1, 7)
TENSIONS = (0.04, 0.4, 4.0)
VERTICES = (12, 24, 48)
RIGID, ROUND = 0.8, 0.3  # shares of whole droplets in slow and in fast modes
_LAW = {"gamma": 0.4, "eps": 1.0, "nv_small": 12}
_DRAG = {"contact": {"damping": "contact", "beta": 1.0, "eta_f": np.nan}, "stokes": {"damping": "stokes", "eta_f": 1.0}}


def _who(seed, **law):
    return {"model": "dp", "n": 32, "seed": seed} | _LAW | law


def droplet_modes():
    """Slow modes, whose rate goes with gamma, are 80 % rigid and slide; fast ones are 30 % rigid and approach."""
    rows = []
    for seed, (drag, of), rho in product(SEEDS, _DRAG.items(), reduced.FRACTIONS):
        for gamma in TENSIONS if rho == 0.90 else (0.4,):
            who = _who(seed, gamma=gamma) | of | {"rho": rho}
            slow, middle = (1e-3 * gamma / 0.4, 1.1) if drag == "contact" else (0.1, 2.0)
            for rate, rigid, slides in ((slow, RIGID, 1.0), (middle, ROUND, 0.0)):
                parts = {"translation": 0.5 * rigid, "rotation": 0.5 * rigid, "along": 0.5 * (1 - rigid)}
                rows.append(
                    {**who, "rate": rate, "strength": 1.0, **parts, "across": 0.5 * (1 - rigid), "sliding": slides}
                )
    return pd.DataFrame(rows)


def droplet_voids():
    """Voids of a lattice of equal disks, as many in every state, twelve times as many without three sides."""
    rows = []
    for seed, nv in product(SEEDS, VERTICES):
        overlap, shape = three_disks(np.geomspace(1e-4, 0.05, 12))
        for state, (o, s) in enumerate(zip(overlap, shape, strict=True)):
            who = _who(seed, nv_small=nv) | {"state": state, "rho": 0.84 + 0.012 * state, "overlap": o}
            rows.append({**who, "voids": 13, "three": 1, "shape_of_three": s})
    return pd.DataFrame(rows)


TABLES = {"droplet_modes": droplet_modes, "droplet_voids": droplet_voids}
