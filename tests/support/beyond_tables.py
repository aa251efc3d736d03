"""Made-up tables of droplets of several force laws, in which known laws hold: for tests of the figures beyond-*."""

from itertools import product

import numpy as np
import pandas as pd
import paper_tables

from studies import ensemble_tables as reduced
from studies.beyond.droplet_structure import three_disks

SEEDS = range(1, 7)
TENSIONS = (0.04, 0.4, 4.0)
VERTICES = (12, 24, 48)
RIGID, ROUND = 0.8, 0.3  # shares of whole droplets in slow and in fast modes
LIMIT, SLOPE = 0.2, 1.2  # G of many vertices at a distance of 0.1, and its change with their inverse number
_LAW = {"gamma": 0.4, "eps": 1.0, "nv_small": 12}
_NO_LAW = dict.fromkeys(_LAW, np.nan)
_DRAG = {"contact": {"law": "contact", "beta": 1.0, "eta_f": np.nan}, "stokes": {"law": "stokes", "eta_f": 1.0}}


def _who(model, seed, **law):
    return {"model": model, "n": 32, "seed": seed} | (_NO_LAW if model == "sp" else _LAW) | law


def droplet_states():
    """Those of the paper's laws, but for G, which is linear in the distance and in the inverse number of vertices."""
    parts = []
    for nv in VERTICES:
        table = paper_tables.states("dp", (16,)).assign(**_LAW | {"nv_small": nv})
        spread = 0.02 * 2**0.55 * (table["seed"] - 3) / 2.5**0.5  # as that of the papers' onsets, of N = 16
        table = table.assign(rho=table["rho"] - table["onset"] + 0.81 + spread, onset=0.81 + spread)
        parts.append(
            table.assign(g=(LIMIT + SLOPE / nv) * (table["rho"] - table["onset"]) / 0.1 * _tilt(table["seed"]))
        )
    return reduced.droplet_states(pd.concat(parts))


def _tilt(seed):
    """Scatter between packings whose mean is 1."""
    return 1 + 0.01 * (seed - 3)


def droplet_spectra():
    """A static modulus in proportion to gamma, and one relaxation."""
    rows = []
    for seed, drag, rho in product(SEEDS, _DRAG.values(), reduced.FRACTIONS):
        for model, gamma in [("sp", 1.0), *(("dp", g) for g in TENSIONS if g == 0.4 or rho == 0.90)]:
            who = _who(model, seed, **{"gamma": gamma} if model == "dp" else {}) | drag
            for omega in np.geomspace(1e-6, 1e2, 5):
                rows.append({**who, "rho": rho, "omega": omega, "storage": gamma * rho, "loss": omega})
    return pd.DataFrame(rows)


def droplet_modes():
    """Slow modes, whose rate goes with gamma, are 80 % rigid and slide; fast ones are 30 % rigid and approach."""
    rows = []
    for seed, (drag, of), rho in product(SEEDS, _DRAG.items(), reduced.FRACTIONS):
        for gamma in TENSIONS if rho == 0.90 else (0.4,):
            who = _who("dp", seed, gamma=gamma) | of | {"rho": rho}
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
            who = _who("dp", seed, nv_small=nv) | {"state": state, "rho": 0.84 + 0.012 * state, "overlap": o}
            rows.append({**who, "voids": 13, "three": 1, "shape_of_three": s})
    return pd.DataFrame(rows)


TABLES = {
    "droplet_states": droplet_states,
    "droplet_spectra": droplet_spectra,
    "droplet_modes": droplet_modes,
    "droplet_voids": droplet_voids,
}
