"""What holds a packing: a periodic box alone, fixed particles in it, or two walls, rough or flat.

`Packing.frame` is one of the classes below. They answer the same questions, and nothing else asks what kind of frame a
packing has: another kind is a class here and a line in `frame_of`.

A deformation gradient F of the box carries a free site from x to F x, from where it relaxes. The centre c of a fixed
droplet goes to F c. Its outline is sheared with the box and keeps its area, as fixed disks keep their diameters: x = c
+ s goes to F c + F s/sqrt(det F). Walls keep their shape: the wall at a lattice plane of height h moves with that
plane, by F_xy h along x and (F_yy - 1) h along y. So only two strains are defined between walls: simple shear along x,
and compression along y at constant width.

Energies of strained packings, stress, pressure and linear response follow from this one map: S = -(1/A) dU/dF.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, ClassVar, Generic

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array, Mask
from jamlab.errors import InputError
from jamlab.packing.bare_packing import BarePacking, P
from jamlab.packing.derived import per_packing
from jamlab.packing.kinds import kind_of
from jamlab.packing.magnitudes import ROUNDING
from jamlab.packing.strain_map import ALONG_Y, SIMPLE_SHEAR
from jamlab.packing.terms import Terms


class Frame(Generic[P]):
    """A periodic box in which all particles are free; other frames say where they differ.

    Example:
        >>> p = jamlab.pack(n=64, pressure=1e-2, seed=1)
        >>> walled = jamlab.with_walls(p)
        >>> p.frame.all_free, p.frame.translations, walled.frame.translations
        (True, 2, 0)
        >>> p.frame.admits(np.eye(2)), walled.frame.admits(np.eye(2))  # walls take no change of the width
        (True, False)
    """

    all_free: ClassVar[bool] = True  # whether no particle is fixed
    has_walls: ClassVar[bool] = False  # which bear a stress of their own
    is_flat: ClassVar[bool] = False  # whether walls are lines, which particles meet at right angles and slide along
    held_as: ClassVar[str] = ""  # words of `fix overdamped` for what it holds
    # (m, 2, 2) orthonormal generators of the displacement gradients that it admits
    strains: ClassVar[Array] = np.eye(4).reshape(4, 2, 2)
    squeeze: ClassVar[Array] = 0.5 * np.eye(2)  # M of the change of area: a strain e = log of the area, r -> exp(e M) r
    limits: ClassVar[str] = "in this frame"  # where a strain that it does not admit is not defined
    remedy: ClassVar[str] = "use another strain"

    def __init__(self, packing: P) -> None:
        self.packing = packing
        self.positions, self._derived = packing.positions, packing._derived  # where `per_packing` keeps its answers

    # who is fixed -----------------------------------------------------------------------------------------------------

    @property
    def fixed(self) -> Mask:
        """(n,) which particles are fixed."""
        return np.zeros(self.packing.n, dtype=bool)

    @property
    def free(self) -> Mask:
        """(n,) which particles are free."""
        return ~self.fixed

    @property
    def fixed_sites(self) -> Mask:
        """(n_sites,) whether each position belongs to a fixed particle."""
        return np.zeros(len(self.positions), dtype=bool)

    @property
    def free_sites(self) -> Mask:
        """(n_sites,) whether each position belongs to a free particle."""
        return ~self.fixed_sites

    def hold(self, values: Array, each: int = 1) -> Array:
        """Set values of all sites, `each` of one site in the first axis, to 0 where a site is fixed."""
        return values

    def between_free(self, terms: list[Terms]) -> list[Terms]:
        """Energy terms whose Hessians couple free sites alone."""
        return terms

    def placed(self, terms: list[Terms]) -> list[Terms]:
        """Energy terms whose sites lie where strains move them from, x + d of `wall_offsets`."""
        return terms

    # motion of all together -------------------------------------------------------------------------------------------

    @property
    def translations(self) -> int:
        """Number of directions in which all free particles may move together at no energy."""
        return 2

    @property
    def slips(self) -> bool:
        """Whether drag alone resists a common motion of the free particles along walls."""
        return self.translations == 1

    def drift(self, values: NDArray[Any], axis: int = 0) -> NDArray[Any] | float:
        """Mean of values over all sites, or over all particles, in an axis that is kept. Displacements are given
        without this motion of the whole; it is 0 where particles are fixed."""
        return np.asarray(values.mean(axis=axis, keepdims=True))

    # strains ----------------------------------------------------------------------------------------------------------

    def admits(self, generators: Array | Sequence[Array]) -> bool:
        """Whether strains (2, 2) or (m, 2, 2), generators of displacement gradients, are defined."""
        basis, wanted = self.strains.reshape(-1, 4), np.reshape(generators, (-1, 4))
        left = wanted - wanted @ basis.T @ basis
        return bool(np.abs(left).max() <= ROUNDING * np.abs(wanted).max())

    def undefined(self, what: str) -> str:
        """Return the sentence that says why something is not defined."""
        return f"{what} is not defined {self.limits}"

    def check_admitted(self, generators: Array | Sequence[Array], what: str) -> None:
        """Refuse strains that are not defined. `what` needs them."""
        if not self.admits(generators):
            raise InputError(f"{self.undefined(what)}: {self.remedy}")

    @property
    def wall_offsets(self) -> Array:
        """(n_sites, 2) d: a displacement gradient E moves a site at x by E (x + d). A site of a wall has, with d, the
        height of the lattice plane next to its particle; others have d = 0."""
        return np.zeros_like(self.positions)

    @property
    def kept_shapes(self) -> Array:
        """(n_sites, 2) s: sites of fixed droplets from their centre; 0 for disks, free droplets and walls."""
        return np.zeros_like(self.positions)

    def carried(self, gradient: Array, rotation: Array | None = None) -> Array:
        """(n_sites, 2) positions after a deformation gradient F of the box, and a rotation (2, 2) of everything."""
        return self.positions @ ((np.eye(2) if rotation is None else rotation) @ gradient).T

    # flat walls -------------------------------------------------------------------------------------------------------

    @property
    def flat_sites(self) -> Mask:
        """(n_sites,) whether each position is that of a flat wall."""
        return np.zeros(len(self.positions), dtype=bool)

    @property
    def sizes(self) -> Array:
        """Sizes of all particles but flat walls, which have none."""
        return kind_of(self.packing).sizes(self.packing)

    @property
    def planes(self) -> tuple[float, float]:
        """Heights between which all particles lie: surfaces of flat walls, else the edges of the cell."""
        return 0.0, float(self.packing.box[1, 1])

    @property
    def images(self) -> P:
        """A packing without walls in which the same space is free: the packing itself, or, between flat walls, its
        particles followed by their mirror images behind a wall, in a box of twice the height of the slab.

        The points of a slab are nearer to its particles than to their images, so that cells, particles cut by them and
        the boundary of what they cover end at the planes of the walls."""
        return self.packing

    def pull_back(self, values: Array, of_walls: float = 0.0) -> Array:
        """(n,) values of the particles of the packing from those of `images`; `of_walls`: that of flat walls."""
        return values


class FixedParticles(Frame[P]):
    """A periodic box with fixed particles, which move with strains of the box alone."""

    all_free = False
    held_as = "fixed"

    @property
    def fixed(self) -> Mask:
        assert self.packing.fixed is not None  # of this frame
        return self.packing.fixed

    @property
    @per_packing
    def fixed_sites(self) -> Mask:
        return np.asarray(self.fixed[self.packing.particle])

    def hold(self, values: Array, each: int = 1) -> Array:
        values[np.repeat(self.fixed_sites, each)] = 0.0
        return values

    def between_free(self, terms: list[Terms]) -> list[Terms]:
        found = []
        for term in terms:
            free = self.free_sites[term.sites].astype(np.float64)
            hessian = term.hessian * free[:, :, None, None, None] * free[:, None, None, :, None]
            found.append(replace(term, hessian=hessian))
        return found

    @property
    def translations(self) -> int:
        return 0

    def drift(self, values: NDArray[Any], axis: int = 0) -> NDArray[Any] | float:
        return 0.0

    @property
    @per_packing
    def kept_shapes(self) -> Array:
        centres = self.packing.centroids[self.packing.particle]
        return np.where(self.fixed_sites[:, None], self.positions - centres, 0.0)

    def carried(self, gradient: Array, rotation: Array | None = None) -> Array:
        turn = np.eye(2) if rotation is None else rotation
        moved = super().carried(gradient, rotation)
        moved += self.wall_offsets @ (turn @ (gradient - np.eye(2))).T
        kept = 1.0 / np.sqrt(np.linalg.det(gradient)) - 1.0
        moved += self.kept_shapes @ (turn @ gradient).T * kept
        return moved


class RoughWalls(FixedParticles[P]):
    """A slab between two walls of fixed particles, which move as rigid bodies."""

    has_walls = True
    held_as = "walls"
    strains = np.array([SIMPLE_SHEAR, ALONG_Y])
    squeeze = ALONG_Y
    limits = "between walls, which take simple shear along x and compression along y alone"
    remedy = (
        "use direction='simple', as in shear_modulus(p, direction='simple') (g_x), and bulk_modulus(p) (b), or remove "
        "the walls with "
        "packing.with_state(walls=False, fixed=None)"
    )

    @property
    @per_packing
    def wall_offsets(self) -> Array:
        height, offsets = self.packing.box[1, 1], np.zeros_like(self.positions)
        plane = height * np.round(self.packing.centroids[:, 1] / height)[self.packing.particle]
        offsets[self.fixed_sites, 1] = (plane - self.positions[:, 1])[self.fixed_sites]
        return offsets

    @property
    def kept_shapes(self) -> Array:
        return np.zeros_like(self.positions)

    def placed(self, terms: list[Terms]) -> list[Terms]:
        offsets = self.wall_offsets
        return [replace(term, local=term.local + offsets[term.sites]) for term in terms]


class FlatWalls(RoughWalls[P]):
    """A slab between two lines along x, the last two particles, of one site and of size 0."""

    is_flat = True

    @property
    def translations(self) -> int:
        return 1 if np.array_equal(self.packing.flat_walls, self.fixed) else 0  # along x

    @property
    @per_packing
    def flat_sites(self) -> Mask:
        return np.asarray(self.packing.flat_walls[self.packing.particle])

    @property
    def sizes(self) -> Array:
        return np.asarray(super().sizes[~self.packing.flat_walls])

    @property
    @per_packing
    def planes(self) -> tuple[float, float]:
        y = np.sort(self.positions[self.flat_sites, 1] % self.packing.box[1, 1])
        rim = 0.5 * float(self.packing.params.get("delta", 0.0))
        return float(y[0] + rim), float(y[-1] - rim)

    @property
    @per_packing
    def images(self) -> P:
        (low, high), lattice = self.planes, self.packing.box[1]
        free = self.packing.select(~self.packing.flat_walls)
        site, n = free.particle, np.arange(len(free.positions))
        x = free.positions - np.outer(np.floor(free.centroids[:, 1] / lattice[1]), lattice)[site]
        first = np.searchsorted(site, np.arange(free.n))
        reversed_ = (first + np.append(first[1:], len(n)) - 1)[site] - n  # polygons stay counter-clockwise
        own = {name: np.tile(free.params[name], 2) for name, each in free.parameters.items() if each.each}
        return free.with_state(
            box=np.diag([free.box[0, 0], 2 * (high - low)]),
            positions=np.concatenate([x, x[reversed_] * [1, -1] + [0, 2 * low]]) - [0, low],
            params={**free.params, **own},
            diameters=None if free.diameters is None else np.tile(free.diameters, 2),
            offsets=None if free.offsets is None else np.append(free.offsets, free.offsets[1:] + len(n)),
            rounding=0.0,
        )

    def pull_back(self, values: Array, of_walls: float = 0.0) -> Array:
        flat = self.packing.flat_walls
        found = np.full(len(flat), of_walls)
        found[~flat] = values[: len(values) // 2]
        return found


def frame_of(packing: P) -> Frame[P]:
    """Return the frame of a packing."""
    if packing.fixed is None:
        return Frame(packing)
    if not packing.walls:
        return FixedParticles(packing)
    return FlatWalls(packing) if packing.flat_walls.any() else RoughWalls(packing)


def checked_fixed(packing: BarePacking) -> Mask | None:
    """Return the mask of fixed particles, None if none is fixed, and refuse one that no frame has."""
    mask = None if packing.fixed is None else np.array(packing.fixed)
    if mask is not None and (mask.dtype != bool or mask.shape != (packing.n,)):
        raise InputError(f"fixed is {mask.dtype} of shape {mask.shape}: give {packing.n} truth values, one a particle")
    if mask is not None and mask.all():
        raise InputError(f"fixed: all {packing.n} particles are fixed: leave at least one free")
    if packing.walls and (mask is None or not mask.any()):
        raise InputError("walls=True, but no particle is fixed: make walls with jamlab.with_walls(packing)")
    if packing.walls and packing.ensemble != "fixed-box":
        raise InputError(
            f"ensemble = {packing.ensemble!r} with walls=True: it stretches the box, and walls keep their shape; use "
            'ensemble="fixed-box", or remove the walls, walls=False and fixed=None'
        )
    if (flat := packing.flat_walls).any():
        last = np.arange(packing.n) >= packing.n - 2
        held = packing.walls and mask is not None and mask[last].all()
        if not (held and np.array_equal(flat, last) and (np.bincount(packing.particle)[last] == 1).all()):
            raise InputError(
                f"{kind_of(packing).size_name}s[{flat.argmax()}] = 0: must be positive; flat walls alone, the last two "
                "particles, have size 0: make them with jamlab.with_walls(packing, flat=True), or leave them out with "
                "packing.select(~packing.flat_walls)"
            )
    return mask if mask is not None and mask.any() else None
