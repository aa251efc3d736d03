"""Packings with every feature that a packing may have, for tables of what functions give of them."""

from pathlib import Path

import numpy as np

import jamlab

STATES = Path(__file__).parents[1] / "states"
TURN = 0.7  # radian
PACKED = {}  # arguments -> packing: several features begin from one, which none changes


def _pack(*args, **kwargs):
    key = repr((args, kwargs))
    return PACKED[key] if key in PACKED else PACKED.setdefault(key, jamlab.pack(*args, **kwargs))


def _fixed(p, mask):
    return p.with_state(fixed=mask, converged=True, max_force=p.max_force)


def _leaning(p, k):
    box = np.array(p.box)
    box[1] += k * box[0]
    return p.with_state(box=box, converged=True, max_force=p.max_force)


def _strained(p):
    """No longer where forces on fixed particles vanish."""
    direction = "simple" if p.walls else TURN
    step = jamlab.quasistatic_shear(
        p, 0.02, 0.01, direction=direction, force_tolerance=1e-13 if p.model == "sp" else 1e-11
    )
    return step.packing


def _in_units(p, length, stress):
    """The same packing in other units."""
    law = p.params | {"k": p.params["k"] * stress}
    scaled = p.with_state(box=p.box * length, positions=p.positions * length, diameters=p.diameters * length)
    return jamlab.relax(scaled.with_state(params=law))


def _droplets():
    return jamlab.read(STATES / "few_droplets.h5")  # two of 8 vertices, two of 11


def _lattice(*rows, params, diameter=1.0):
    """One disk and its images."""
    return jamlab.Packing("sp", list(rows), [[0.2, 0.3]], params, next(iter(params)), [diameter])


def _one_droplet():
    """One droplet of 11 vertices that six images of itself press on, in a leaning box."""
    one = _droplets().select(np.arange(4) == 3)
    box = np.sqrt(one.phi * one.area / 0.97 / 0.75**0.5) * np.array([[1, 0], [2.5, 0.75**0.5]])
    return jamlab.relax(one.with_state(box=box, ensemble="fixed-box"), 1e-12)


def _walled_droplets():
    """Two layers of the few droplets, of which walls take one apart: as high as walls and a slab must be."""
    few = _droplets()
    law = few.params | {"a0": np.tile(few.params["a0"], 2)}
    offsets = np.append(few.offsets, few.offsets[1:] + few.offsets[-1])
    layers = np.vstack([few.positions, few.positions + few.box[1]])
    return _strained(jamlab.with_walls(jamlab.Packing("dp", few.box * [[1], [2]], layers, law, offsets=offsets), 1.18))


MASK = np.arange(16) % 5 == 0
FEATURES = {
    "disks": lambda: _pack(16, 1e-2, 1),
    "leaning": lambda: _leaning(_pack(16, 1e-2, 1), -5),
    "rattlers": lambda: _pack(16, 1e-3, 10),
    "shear-stabilized": lambda: _pack(16, 1e-3, 2, ensemble="shear-stabilized"),
    "exponent 2.5": lambda: _pack(16, 1e-2, 1, law={"exponent": 2.5}),
    "exponent 4": lambda: _pack(16, 1e-3, 1, law={"exponent": 4}),
    "lognormal": lambda: _pack(17, 1e-2, 2, sizes="lognormal:0.4"),
    "other units": lambda: _in_units(_pack(16, 1e-2, 1), 2.5e-3, 40.0),
    "eps, leaning": lambda: _leaning(_of_eps(), 1),
    "sticky, p > 0": lambda: _pack(16, 1e-2, 1, law={"stickiness": 0.03}),
    "sticky, p < 0": lambda: _pack(16, -1e-3, 1, law={"stickiness": 0.04}),
    "sticky network": lambda: _pack(24, phi=0.75, seed=3, law={"stickiness": 0.1}),
    "fixed some": lambda: _fixed(_pack(16, 1e-2, 1), MASK),
    "fixed all but one": lambda: _strained(_fixed(_pack(16, 1e-2, 1), np.arange(16) != 3)),
    "fixed, leaning": lambda: _leaning(_strained(_fixed(_pack(16, 1e-2, 2), MASK)), 2),
    "fixed, exponent 2.5": lambda: _strained(_fixed(_pack(16, 1e-2, 2, law={"exponent": 2.5}), MASK)),
    "fixed, sticky": lambda: _strained(_fixed(_pack(16, 1e-2, 1, law={"stickiness": 0.03}), MASK)),
    "fixed, shear-stabilized": lambda: jamlab.relax(
        _pack(16, 1e-2, 1).with_state(fixed=MASK, ensemble="shear-stabilized")
    ),
    "rough": lambda: jamlab.with_walls(_pack(32, 1e-2, 1), 1.3),
    "rough, leaning": lambda: _leaning(_strained(jamlab.with_walls(_pack(32, 1e-2, 1), 1.3)), 2),
    "rough, exponent 2.5": lambda: jamlab.with_walls(_pack(32, 1e-2, 2, law={"exponent": 2.5}), 1.3),
    "rough, sticky": lambda: jamlab.with_walls(_pack(32, 1e-2, 1, law={"stickiness": 0.02}), 1.3),
    "rough, lognormal": lambda: jamlab.with_walls(_pack(40, 1e-2, 1, sizes="lognormal:0.2"), 1.7),
    "flat": lambda: _flat(_pack(16, 1e-2, 1)),
    "flat, leaning": lambda: _leaning(_flat(_pack(16, 1e-2, 1)), 1),
    "flat, exponent 2.5": lambda: _flat(_pack(16, 1e-2, 1, law={"exponent": 2.5})),
    "flat, sticky": lambda: _flat(_pack(32, 1e-2, 2, law={"stickiness": 0.02})),
    "N = 1": lambda: _lattice([0.95, 0], [0.475, 0.95 * 0.75**0.5], params={"k": 1.0}),
    "N = 1, leaning": lambda: _lattice([1.9, 0], [4.75, 1.9 * 0.75**0.5], params={"eps": 2.0}, diameter=2.0),
    "N = 1, sticky": lambda: _lattice([1.01, 0], [0.505, 1.01 * 0.75**0.5], params={"k": 1.0, "stickiness": 0.05}),
    "N = 1, droplet": lambda: _one_droplet(),
    "N = 2": lambda: _pack(2, 1e-2, 1),
    "N = 3": lambda: _pack(3, 1e-2, 1, sizes=[1.0, 1.1, 1.3]),
    "N = 4": lambda: _pack(4, 1e-2, 1),
    "droplets": _droplets,
    "droplets, fixed": lambda: _strained(_fixed(_droplets(), np.arange(4) == 1)),
    "droplets, rough": _walled_droplets,
    "droplets, flat": lambda: jamlab.relax(jamlab.with_walls(_droplets(), flat=True), 1e-12),
}


def _of_eps():
    p = _pack(16, 1e-2, 1, law={"exponent": 2.5})
    return jamlab.relax(jamlab.Packing("sp", p.box, p.positions, {"eps": 1.7, "exponent": 3.0}, "eps", p.diameters))


def _flat(p):
    return jamlab.relax(jamlab.with_walls(p, flat=True), 1e-13)
