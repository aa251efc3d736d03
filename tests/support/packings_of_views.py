"""Packings that the views of `invariant_cases.py` see otherwise."""

from functools import cache
from pathlib import Path

import jamlab

STATES = Path(__file__).parents[1] / "states"


def _disks(sizes=None, **pack):
    return jamlab.pack(ensemble="shear-stabilized", sizes=sizes, **pack)


@cache
def packings():
    """Packings at a minimum, well above onset, which are stable in a cell of four as well: disks of either unit, with
    rattlers, Hertzian ones of many sizes, and droplets. For single functions: dense disks, and droplets in a square.

    Droplets put in the place of the disks at 1e-2 end in one of several minima, by the last digit of where they start.
    """
    files = {"dp": "few_droplets.h5", "square": "droplets_at_onset.h5"}
    droplets = {name: jamlab.read(STATES / file) for name, file in files.items()}
    droplets["dp"] = jamlab.relax(droplets["dp"].with_state(params=droplets["dp"].params | {"eta": 0.01}))
    adhesion = {"adhesion": 0.05, "adhesion_range": 0.2}
    droplets["adhesive"] = jamlab.relax(droplets["dp"].with_state(params=droplets["dp"].params | adhesion))
    outlines = {"kappa": 0.02, "theta0": 0.6, "kp": 0.5, "kl": 0.3, "p0": 3.7}
    droplets["vesicles"] = jamlab.relax(droplets["dp"].with_state(params=droplets["dp"].params | outlines))
    law = {"eps": 1.7, "exponent": 3.0}
    p = _disks(n=12, pressure=3e-3, seed=2, size_ratio=3.0)
    disks = {
        "sp": _disks(n=14, pressure=3e-3, seed=6),
        "eps": jamlab.relax(jamlab.Packing("sp", p.box, p.positions, law, "eps", p.diameters)),
        "hertz": _disks("lognormal:0.4", n=12, pressure=1e-2, seed=6, law="hertz"),
        "dense": jamlab.pack(n=12, pressure=3e-2, seed=1),
        "sticky": _disks(n=14, pressure=-1e-3, seed=6, law={"stickiness": 0.04}),
    }
    law, q = {"eps": 1.7, "stickiness": 0.03}, disks["sticky"]
    disks["sticky eps"] = jamlab.relax(jamlab.Packing("sp", q.box, q.positions, law, "eps", q.diameters))
    return disks | droplets
