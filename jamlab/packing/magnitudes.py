"""Limits on lengths: beyond them numbers overflow or lose their digits, and searches never end."""

from dataclasses import dataclass

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import InputError


@dataclass(frozen=True)
class Extremes:
    """Range of lengths in which float64 and searches work."""

    longest: float = 1e100  # areas, their squares and ratios then stay far from the ends of float64, 1e308 and 1e-308
    flattest: float = 1e6  # width over height of the box, and tilt over width: a search walks over as many images
    # distance from the origin over the size of the box: float64 then keeps seven digits of where in the box
    farthest: float = 1e9
    # sum of squared sizes over the area of the box: pairs that overlap grow alike; jammed packings are at 1
    densest: float = 1e3


EXTREMES = Extremes()

ROUNDING = 1e-12  # relative difference of lengths, or of elements of a matrix, that rounding may cause


def check_magnitudes(box: Array, positions: Array, sizes: Array) -> None:
    """Refuse lengths that no computation in float64 can handle, before any begins.

    Args:
        box: (2, 2), rows are the lattice vectors.
        positions: (m, 2).
        sizes: (n,) lengths of the particles, positive.
    """
    width, height, tilt = float(box[0, 0]), float(box[1, 1]), abs(float(box[1, 0]))
    lengths = [width, height, float(sizes.min()), float(sizes.max())]
    if min(lengths) < 1 / EXTREMES.longest or max(lengths) > EXTREMES.longest:
        raise InputError(
            f"box {box.tolist()} and sizes from {sizes.min():.6g} to {sizes.max():.6g}: lengths must lie between "
            f"{1 / EXTREMES.longest:g} and {EXTREMES.longest:g}; choose another unit of length"
        )
    if max(width, height) > EXTREMES.flattest * min(width, height) or tilt > EXTREMES.flattest * width:
        raise InputError(
            f"box {box.tolist()} is flatter or more tilted than 1 : {EXTREMES.flattest:g}: check its numbers"
        )
    far = np.abs(positions).max(axis=1)
    if far.max() > EXTREMES.farthest * max(width, height):
        k = int(far.argmax())
        raise InputError(
            f"positions[{k}] is {positions[k].tolist()}, more than {EXTREMES.farthest:g} boxes away: move it into "
            "the box"
        )
    filled = float(np.sum(sizes**2)) / (width * height)
    if filled > EXTREMES.densest:
        raise InputError(
            f"squared sizes sum up to {filled:.4g} times the area of box {box.tolist()}, more than "
            f"{EXTREMES.densest:g}: "
            "check both"
        )


def check_box(box: Array) -> None:
    """Refuse lattice vectors (2, 2) of no area, and a first one that does not lie along x."""
    if box[0, 1] != 0:
        raise InputError(f"box[0, 1] is {box[0, 1]:.6g}: the first lattice vector must lie along x")
    if box[0, 0] <= 0 or box[1, 1] <= 0:
        raise InputError(f"box {box.tolist()} has no positive area: box[0, 0] and box[1, 1] must be positive")
