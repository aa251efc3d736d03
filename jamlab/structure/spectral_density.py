"""chi_V(k), the spectrum of the area that particles cover, and Fourier transforms of the shapes that it is made of.

What particles cover is bounded by straight pieces and arcs. With e = exp(-i k.x), div(i k e/k^2) = e, and by Gauss

    integral of e over the area = (i/k^2) sum over pieces of the integral of e k.n ds, n outwards.

Gauss-Legendre quadrature takes these integrals to rounding, with points by the phase that a piece spans at `k_max`;
their sum is a sum of waves over points, as S(k) is.

A whole disk has the transform 2 pi R J_1(kR)/k. Lagrange interpolation in R between Chebyshev nodes makes of disks of
many sizes as many sums of waves as there are nodes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from scipy.special import j1

from jamlab.arrays import Array, Complex, Indices
from jamlab.checks import checked
from jamlab.errors import InputError
from jamlab.geometry.boundary_pieces import Pieces
from jamlab.geometry.voids.boundary_loops import trace
from jamlab.motion.between_states import Run
from jamlab.packing.packing import Packing
from jamlab.statistics.rows_of_one_kind import Campaign, Select
from jamlab.structure.structure_factor import ValuesAtWavevectors, Waves, without_walls

CoverMethod: TypeAlias = Literal["exact", "nominal"]


@dataclass(frozen=True)
class Quadrature:
    """How many points take an integral, or an interpolation, to rounding."""

    phase: float = 8.0  # radians that a part of a piece spans at most, k_max times its length; arcs also in angle
    least: int = 6  # points of a part, and one more for each radian of phase or angle
    part: int = 1_000_000  # points of one sum of waves
    nodes: int = 20  # sizes between which those of disks are interpolated, and one more for each radian of phase
    same: float = 1e-12  # relative difference of sizes that are one


QUADRATURE = Quadrature()


class SpectralDensity(ValuesAtWavevectors):
    """chi_V(k) at the wavevectors of one or several packings, see `jamlab.spectral_density`.

    Attributes:
        wavevectors: (m, 2) reciprocal lattice vectors up to `k_max`, without 0; of each pair k, -k the one with
            k_x > 0, or k_x = 0 and k_y > 0. Sorted by packing, k_x and k_y.
        values: (m,) chi_V(k), an area.
        state: (m,) int64, packing of each wavevector, from 0.
        packings: number of packings.
        width: 2 pi over the root of the area of the box, the mean over packings: default width of shells.
        unit: unit of wavevectors, for labels.
        value_unit: unit of values, for labels.

    Example:
        >>> chi = jamlab.spectral_density(jamlab.pack(n=32, pressure=1e-2, seed=1), k_max=12.0)
        >>> chi.wavevectors.shape == (len(chi.values), 2), bool((chi.values >= 0).all())
        (True, True)
    """

    _label = r"spectral density $\chi_V(k)$"


@checked
def spectral_density(
    packings: Packing | Sequence[Packing] | Run | Campaign,
    k_max: float,
    method: CoverMethod = "exact",
    *,
    select: Select | None = None,
) -> SpectralDensity:
    """Compute chi_V(k) = |integral over the covered area of exp(-i k.x)|^2/A, A the area of the box.

    A packing is hyperuniform if chi_V vanishes for k -> 0: its covered area then fluctuates less than in a random
    arrangement (Zachary, Jiao & Torquato, Phys. Rev. E 83, 051308 (2011), eq 9; Torquato, Phys. Rep. 745, 1
    (2018), sec. 3.2). Of each pair k, -k one wavevector is given.

    Args:
        packings: one packing, several of one kind, a flow (its frames), or a campaign (its converged states). Values
            follow each other; `SpectralDensity.shells` averages over packings.
        k_max: longest wavevector, 1/length.
        method: what is covered, as in `jamlab.packing_fraction`:

            * "exact": the union of the particles, of droplets with their rims; the two-phase medium of Torquato.
            * "nominal" (SP): the sum of undeformed disks, overlaps counted twice: |sum of m(k; R)
              exp(-i k.x)|^2/A with m = 2 pi R J_1(kR)/k, as Berthier et al., Phys. Rev. Lett. 106, 120601 (2011), and
              Wu, Olsson & Teitel, Phys. Rev. E 92, 052206 (2015), use for soft disks. At onset both agree.
        select: for a campaign: values of columns of its table "states", such as {"n": 128, "target_pressure": 1e-3}.

    Returns:
        `SpectralDensity`: `wavevectors` (m, 2) and `values` (m,).

    Raises:
        InputError: walls, packings of several kinds, a packing given twice, a method that the model does not have,
            `k_max` below the shortest wavevector of a box, or too many wavevectors.
        BoundaryError: outlines of droplets cross.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> disks = jamlab.spectral_density(p, 9.0, "nominal")
        >>> bool(np.allclose(jamlab.spectral_density(p, 9.0).values, disks.values, atol=2e-3))  # overlaps are small
        True
    """
    each = without_walls(packings, select, "chi_V(k)")
    if method == "nominal" and each[0].kind.sites != 1:
        raise InputError(
            f"method 'nominal' is of undeformed disks, not of {each[0].kind.particles}, which have no place for an "
            "undeformed shape: use 'exact'"
        )

    def one(packing: Packing, waves: Waves) -> Array:
        covered = _of_disks if method == "nominal" else _of_union
        return np.asarray(np.square(np.abs(covered(packing, waves)) / np.sqrt(packing.area)))

    return SpectralDensity._of(each, k_max, one, "{}²")


def _of_disks(packing: Packing, waves: Waves) -> Complex:
    """(m,) sum over disks of their transforms."""
    k = np.hypot(*waves.k.T)
    total = np.zeros(len(k), dtype=np.complex128)
    radii, shares = _shares_of_sizes(0.5 * packing.disk_diameters, float(k.max()))
    for radius, share in zip(radii, shares, strict=True):
        total += disk_transform(k, radius) * waves.sum_over(packing.positions, share)
    return total


def disk_transform(k: Array, radius: float) -> Array:
    """(m,) integral of exp(-i k.x) over a disk around the origin, 2 pi R J_1(kR)/k."""
    return np.asarray(2 * np.pi * radius * j1(k * radius) / k)


def _shares_of_sizes(radii: Array, k: float) -> tuple[Array, Array]:
    """Some radii (p,), and (p, n) how much of each stands for every disk: f(R_j) = sum over p of f(radius_p) share_pj
    for any function of R without waves shorter than 2 pi/k. They are the sizes themselves where there are few."""
    ordered = np.sort(radii)
    kinds = ordered[np.diff(ordered, prepend=0.0) > QUADRATURE.same * ordered]
    low, high = ordered[0], ordered[-1]
    count = QUADRATURE.nodes + int(np.ceil(0.5 * k * (high - low)))
    if len(kinds) <= count:
        nearest = np.searchsorted(kinds, radii * (1 + QUADRATURE.same), side="right") - 1
        return kinds, (np.arange(len(kinds))[:, None] == nearest).astype(np.float64)
    angle = (np.arange(count) + 0.5) * np.pi / count
    nodes = 0.5 * (low + high) + 0.5 * (high - low) * np.cos(angle)
    off = radii - nodes[:, None]
    found = off == 0  # a disk whose size is a node
    weight = ((-1.0) ** np.arange(count) * np.sin(angle))[:, None] / np.where(found, 1.0, off)
    weight = np.where(found.any(axis=0), found, weight)
    return nodes, weight / weight.sum(axis=0)


def _of_union(packing: Packing, waves: Waves) -> Complex:
    """(m,) integral of exp(-i k.x) over what particles cover."""
    squares = np.square(waves.k).sum(axis=1)
    flux = np.zeros(len(squares), dtype=np.complex128)
    for points, along in _points_of(trace(packing).pieces, float(np.sqrt(squares.max()))):
        flux += waves.k[:, 0] * waves.sum_over(points, along[:, 1]) - waves.k[:, 1] * waves.sum_over(
            points, along[:, 0]
        )
    return np.asarray(1j * flux / squares)


def _points_of(pieces: Pieces, k: float) -> Sequence[tuple[Array, Array]]:
    """Points (m, 2) of quadrature along pieces of a boundary, and (m, 2) steps ds along it, counter-clockwise around
    what is covered; in parts."""
    round_ = pieces.radius > 0
    length = np.where(round_, pieces.radius * pieces.angle, np.hypot(*(pieces.end - pieces.start).T))
    phase = np.maximum(k * length, pieces.angle)
    parts = np.maximum(np.ceil(phase / QUADRATURE.phase), 1).astype(np.int64)
    piece = np.repeat(np.arange(len(parts)), parts)
    place = np.arange(len(piece)) - np.repeat(np.cumsum(parts) - parts, parts)  # of each part on its piece
    count = QUADRATURE.least + np.ceil((phase + pieces.angle) / parts).astype(np.int64)[piece]
    found = []
    for points in np.unique(count).tolist():
        node, weight = np.polynomial.legendre.leggauss(points)
        chosen = np.flatnonzero(count == points)
        for some in np.array_split(chosen, 1 + len(chosen) * points // QUADRATURE.part):
            own, share = piece[some], 1.0 / parts[piece[some]]
            t = share[:, None] * (place[some][:, None] + 0.5 * (1 + node))  # from 0 to 1 along the piece
            x, dx = _along(pieces, own, t)
            step = dx * (0.5 * share[:, None] * weight)[..., None]
            found.append((x.reshape(-1, 2), step.reshape(-1, 2)))
    return found


def _along(pieces: Pieces, own: Indices, t: Array) -> tuple[Array, Array]:
    """Points (m, p, 2) at places t (m, p), from 0 to 1, along some pieces, and derivatives by t."""
    turn = pieces.begin[own][:, None] + pieces.angle[own][:, None] * t
    radius = pieces.radius[own][:, None]
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=-1) * radius[..., None]
    quarter = np.stack([-circle[..., 1], circle[..., 0]], axis=-1)
    chord = (pieces.end - pieces.start)[own][:, None]
    straight = (radius == 0)[..., None]
    x = np.where(straight, pieces.start[own][:, None] + t[..., None] * chord, pieces.centre[own][:, None] + circle)
    return x, np.where(straight, chord, pieces.angle[own][:, None, None] * quarter)
