"""One packing of every kind, with all that may be known of a state, for what must come back from files."""

import numpy as np
from wandering_packings import disks, polygons

import jamlab

KNOWN = {
    "max_force": 1e-13 / 3,
    "converged": True,
    "force_tolerance": 1e-12 / 7,
    "on_rattlers": True,
    "on_target": False,
}
HISTORY = {"seed": 7, "protocol": "a b=c%d", "nested": {"x": [1, 2.5, None]}, "source": "photo.png", "_known": {"u": 1}}


def known(packing, **more):
    """With all that may be known of a state."""
    return packing.with_state(**KNOWN, phi_J=0.8 + 1 / 30, provenance=HISTORY, **more)


def law(packing, **params):
    return packing.with_state(params={**packing.params, **params})


def lattice(side=4):
    places = np.stack(np.meshgrid(np.arange(side), np.arange(side)), axis=-1).reshape(-1, 2) + 0.5
    return jamlab.Packing("sp", side * np.eye(2), places, {"k": 1}, "k", np.full(side**2, 1.0625))


def many_sizes():
    sizes, places = np.linspace(1, 2, 100)[::-1], 9 * np.random.default_rng(1).random((100, 2))
    return jamlab.Packing("sp", 9 * np.eye(2), places, {"eps": 1.0}, diameters=sizes)


def bits(packing):
    return np.arange(packing.n) % 3 == 1


def walled(packing):
    return jamlab.with_walls(packing.with_state(positions=packing.positions), 1.0)


KINDS = {
    "springs k": lambda: known(disks(1, 1 / 3, "k")),
    "energies eps": lambda: known(disks(2, 0.0)),
    "stiffening, a whole number": lambda: known(law(disks(3, 0.0, "k"), exponent=3, k=2)),
    "sticky, single precision": lambda: known(law(disks(4, 0.0), stickiness=np.float32(0.1), eps=np.float32(2.5))),
    "shear-stabilized": lambda: known(disks(5, -1.1, "k"), ensemble="shear-stabilized"),
    "100 sizes": lambda: known(many_sizes()),
    "short numbers": lambda: known(lattice()),
    "fixed disks": lambda: known(disks(6, 0.0), fixed=bits(disks(6, 0.0))),
    "rough walls": lambda: known(jamlab.with_walls(lattice(), 1.0)),
    "flat walls": lambda: known(jamlab.with_walls(lattice(), flat=True)),
    "rounded": lambda: disks(7, 1 / 3).with_state(rounding=1e-2, on_target=False, provenance=HISTORY),
    "nothing known": lambda: lattice(),
    "droplets of mixed vertex counts": lambda: known(polygons(1, 1 / 3)),
    "fixed droplets": lambda: known(polygons(2, 0.0), fixed=np.arange(5) > 2),
    "one disk": lambda: known(jamlab.Packing("sp", 2 * np.eye(2), [[0.3, 1.7]], {"k": 1.0}, "k", [1.0])),
}
