"""Limits on the lengths of a packing: beyond them numbers overflow or lose their digits, and searches never end."""

import numpy as np
from numpy.typing import NDArray

from jamlab.errors import InputError

Array = NDArray[np.float64]

LONGEST = 1e100  # areas, their squares and ratios then stay far from the ends of float64, 1e308 and 1e-308
FLATTEST = 1e6  # width over height of the box, and tilt over width: a search walks over as many images
FARTHEST = 1e9  # distance from the origin over the size of the box: float64 then keeps seven digits of where in the box
DENSEST = 1e3  # sum of squared sizes over the area of the box: pairs that overlap grow alike; jammed packings are at 1


def check_magnitudes(box: Array, positions: Array, sizes: Array) -> None:
    """Refuse lengths that no computation in float64 can handle, before any begins.

    Args:
        box: (2, 2), rows are the lattice vectors.
        positions: (m, 2).
        sizes: (n,) lengths of the particles, positive.

    Raises:
        InputError: naming the length and the limit.
    """
    width, height, tilt = float(box[0, 0]), float(box[1, 1]), abs(float(box[1, 0]))
    lengths = [width, height, float(sizes.min()), float(sizes.max())]
    if min(lengths) < 1 / LONGEST or max(lengths) > LONGEST:
        raise InputError(
            f"box {box.tolist()} and sizes from {sizes.min():.6g} to {sizes.max():.6g}: lengths must lie between "
            f"{1 / LONGEST:g} and {LONGEST:g}; choose another unit of length"
        )
    if max(width, height) > FLATTEST * min(width, height) or tilt > FLATTEST * width:
        raise InputError(f"box {box.tolist()} is flatter or more tilted than 1 : {FLATTEST:g}: check its numbers")
    far = np.abs(positions).max(axis=1)
    if far.max() > FARTHEST * max(width, height):
        k = int(far.argmax())
        raise InputError(
            f"positions[{k}] is {positions[k].tolist()}, more than {FARTHEST:g} boxes away: move it into the box"
        )
    filled = float(np.sum(sizes**2)) / (width * height)
    if filled > DENSEST:
        raise InputError(
            f"squared sizes sum up to {filled:.4g} times the area of box {box.tolist()}, more than {DENSEST:g}: "
            "check both"
        )
