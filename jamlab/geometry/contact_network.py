"""The contact network: who touches whom, with which force and gap, which particles rattle, and z."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array, Indices
from jamlab.checks import checked, is_number
from jamlab.errors import InputError
from jamlab.kernels.library import INTEGER, INTEGERS, kernel
from jamlab.laws.pair_law import LEAST_CONTACTS
from jamlab.packing.derived import per_packing
from jamlab.packing.packing import Packing
from jamlab.packing.recipe import changed
from jamlab.packing.result import Result
from jamlab.plotting.drawable import CELL, drawn
from jamlab.plotting.palette import BLUE, OUTLINE, PARTICLE, RATTLER, RED

# Version of what counts as a contact, of z and of rattlers, see jamlab.campaign.tasks; files of flows hold it too.
# In 2 contacts of droplets below 3e-4 of the mean force held no droplet; 1 and 2 counted vertices on edges in flows.
CONTACTS_DEFINITION = 3

_PAIRS = (INTEGER, INTEGERS, INTEGERS)
_find_rattlers = kernel("find_rattlers", *_PAIRS, INTEGER, INTEGERS, INTEGER, INTEGERS, INTEGERS)


def find_rattlers(
    pairs: Indices, suspects: NDArray[np.bool_], least: int = LEAST_CONTACTS, places: Indices | None = None
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Remove particles with too few contacts, again and again, until all others have enough. `pairs`:
    (m, 2) particles that touch; `suspects`: (n,) particles that may rattle; the others count as held; `least`: contacts
    of a particle that is held; `places`: (m,) at which each pair touches, by default one. Returns (n,) rattlers, and
    (m,) contacts that bear force, those between two particles that do not rattle."""
    pairs, suspects = np.ascontiguousarray(pairs), suspects.astype(np.int64)
    places = np.ones(len(pairs), dtype=np.int64) if places is None else np.ascontiguousarray(places)
    rattlers, bearing = np.empty(len(suspects), dtype=np.int64), np.empty(len(pairs), dtype=np.int64)
    _find_rattlers(len(pairs), pairs, places, len(suspects), suspects, least, rattlers, bearing)
    return rattlers.astype(bool), bearing.astype(bool)


@dataclass(frozen=True)
class ContactForces(Result):
    """Forces of contacts, rows as in `Contacts.pairs`.

    Attributes:
        on_j: (m, 2) force on particle j; that on i is the opposite. Droplets: the sum over all meetings of a vertex of
            one with an edge of the other.
        gap: (m,) distance of the surfaces, negative where they overlap. SP: r - (d_i + d_j)/2. DP: d - delta at the
            closest vertex.
        pairs: (m, 2) int64, as in `Contacts`.

    Example:
        >>> f = jamlab.contacts(jamlab.pack(n=32, pressure=1e-2, seed=1)).forces
        >>> bool((f.gap < 0).all()), np.allclose(f.size, -f.gap)  # k = 1: the force is the overlap
        (True, True)
    """

    _rows = ("pairs", "size", "gap", "on_j")

    on_j: Array
    gap: Array
    pairs: Indices = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int64), repr=False)

    @property
    def size(self) -> Array:
        """(m,) magnitude of the force."""
        return np.asarray(np.hypot(*self.on_j.T))

    @property
    def pulls(self) -> NDArray[np.bool_]:
        """(m,) whether the two attract each other, as sticky disks do that do not overlap."""
        return np.asarray(self.gap > 0)


def per_length(push: Array, distance: Array) -> Array:
    """Force over distance; disks in one place, or a vertex on an edge, have no direction to be pushed in."""
    return np.divide(push, distance, out=np.zeros_like(push), where=distance > 0)


@dataclass(frozen=True)
class Contacts(Result):
    """Force-bearing contacts of a packing.

    Attributes:
        pairs: (m, 2) int64, particles i <= j that press on each other, whatever their force. Several circulo-line
            contacts of one pair of droplets are one contact; contacts with two periodic images of one particle, in very
            small boxes, are two.
        rattlers: (n,) bool, free particles with fewer than three contacts above the threshold, found recursively. Of
            particles made of several disks, every contact of two disks counts.
        bearing: (m,) bool, contacts above the threshold between two particles that are not rattlers, one of them free.
        r: (m, 2) float64, vector from the centroid of i to the centroid of the image of j that it touches.
        shift: (m, 2) int64, which image of j: multiples of the two rows of the box.
        packing: the packing whose contacts they are.

    Example:
        >>> c = jamlab.contacts(jamlab.pack(n=32, pressure=1e-2, seed=1))
        >>> c.n_contacts >= c.isostatic, c.forces.size.shape == c.bearing.shape
        (True, True)
    """

    _rows = ("pairs", "r", "shift", "bearing")
    _apart = ("rattlers",)

    pairs: NDArray[np.int64]
    rattlers: NDArray[np.bool_]
    bearing: NDArray[np.bool_]
    r: NDArray[np.float64]
    shift: NDArray[np.int64]
    packing: Packing = field(repr=False, compare=False)

    @property
    def n_contacts(self) -> int:
        """N_c, number of contacts that bear force."""
        return int(self.bearing.sum())

    @property
    def n_backbone(self) -> int:
        """N', number of free particles that are not rattlers."""
        return int((~self.rattlers & self.packing.frame.free).sum())

    @property
    def unjammed(self) -> bool:
        """Whether the packing is unjammed: every particle is a rattler if contacts of any force count."""
        return bool((_contacts_of_all(self.packing)[1] | self.packing.frame.fixed).all())

    @property
    def z(self) -> float:
        """Coordination number 2 N_c/N' (Boromand et al. print N_c/N); nan if every particle rattles.

        It is the mean number of contacts of a free particle: one with a fixed particle counts half in 2 N_c. For
        packings at rest: in motion drag holds particles as well, and those with two contacts are no rattlers."""
        if not self.n_backbone:
            return float("nan")
        return int(self.packing.frame.free[self.pairs[self.bearing]].sum()) / self.n_backbone

    @property
    def z_all(self) -> float:
        """2 N_c/N of all contacts that press and all particles, at rest or in motion."""
        return 2 * len(self.pairs) / self.packing.n

    @property
    def isostatic(self) -> int:
        """N_c of a frictionless packing of disks at onset in a box of fixed shape with one state of self-stress.

        2 N' - 1; 2 N' + 1 beside fixed particles, which leave no translations; 2 N' between flat walls, which leave
        one. Of 30 packings of 16, 8 and 4 disks 2, 13 and 24 have one to three contacts more, and as many more states
        of self-stress."""
        return 2 * self.n_backbone + 1 - self.packing.frame.translations

    @property
    def forces(self) -> ContactForces:
        """Force and gap of every contact, by the force law of the packing."""
        forces: ContactForces = self.packing.kind.contact_forces(self.packing)
        return replace(forces, pairs=self.pairs)

    def _columns(self) -> dict[str, Any]:
        """Forces, gaps, lengths and directions, from i to j, beside what is stored."""
        forces, angle = self.forces, np.arctan2(self.r[:, 1], self.r[:, 0])
        found = {"force": forces.size, "gap": forces.gap, "length": np.hypot(*self.r.T), "angle": angle}
        return {"pairs": self.pairs} | found | super()._columns()

    @drawn("LineCollection, such as color='black'; `linewidth`: width of the mean force, points", CELL)
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw the force network in the periodic cell: lines between centres, as wide as their forces are strong.

        The legend gives the width of the mean force. Contacts that pull are red. Rattlers are grey, other particles
        pale; axes that show particles already, as after `p.plot(ax)`, keep them.

        >>> p = jamlab.pack(n=64, pressure=1e-3, seed=1)
        >>> ax = jamlab.contacts(p).plot()
        """
        from matplotlib.collections import LineCollection
        from matplotlib.lines import Line2D
        from matplotlib.patches import Patch

        from jamlab.packing.packing_plot import draw_background
        from jamlab.plotting.axes import legend_below, merged
        from jamlab.plotting.periodic_cell import frame_cell, line_everywhere

        packing, strength = self.packing, self.forces.size
        # points, of the mean force: the strongest of disordered packings are three to four times as strong
        look = merged(LineCollection, {"color": BLUE, "linewidth": 2.0, "capstyle": "round"}, style)
        width = look.pop("linewidth")
        if not is_number(width):
            raise InputError(f"linewidth = {width!r:.60}: give one number, the width of the mean force in points")
        bare = not axes.collections
        if bare:
            draw_background(axes, packing, np.where(self.rattlers, RATTLER, PARTICLE))
        if len(strength):
            mean = float(strength.mean())
            widths = width * strength / mean if mean > 0 else strength  # disks in one place press in no direction
            lines, pulls = contact_lines(self), self.forces.pulls
            for kind, drawn_as in ((~pulls, look), (pulls, look | {"color": RED})):
                if kind.any():
                    line_everywhere(axes, lines[kind], packing.box, linewidth=widths[kind], **drawn_as)
        frame_cell(axes, packing.box)
        handles: list[Any] = [Line2D([], [], linestyle="none", label="no contacts")]
        if len(strength):
            label = f"mean force {strength.mean():.3g} {packing.unit_names.force}"
            colour = look.get("edgecolor", look.get("color"))
            handles = [Line2D([], [], color=colour, linewidth=width, label=label)]
            if pulls.any():
                handles.append(Line2D([], [], color=RED, linewidth=width, label="contacts that pull"))
        if bare and (count := int(self.rattlers.sum())):
            label = "every particle rattles" if count == packing.n else f"{count} rattler{'s' * (count > 1)}"
            handles.append(Patch(facecolor=RATTLER, edgecolor=OUTLINE, label=label))
        legend_below(axes, handles)


@checked
def contacts(packing: Packing, *, threshold: float = 0.0) -> Contacts:
    """Find the contacts and rattlers of a packing.

    SP: disks touch if r < (d_i + d_j)/2. DP: droplets touch if a vertex is within delta of the other outline.

    Args:
        packing: SP or DP.
        threshold: smallest force, in units of the mean contact force, of a contact that counts in z and for rattlers,
            0 to 1. Default: 0, every force-bearing contact counts. 3e-4 leaves out contacts that only
            stop a droplet from sliding at onset.

    Raises:
        InputError: DP: if outlines of two polygons cross; or if `threshold` is not between 0 and 1.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> c = jamlab.contacts(p)
        >>> c.pairs.shape == (len(c.bearing), 2), int(c.rattlers.sum())
        (True, 1)
        >>> round(c.z, 3), c.z == 2 * c.n_contacts / c.n_backbone
        (4.452, True)
    """
    if not (is_number(threshold) and 0 <= threshold <= 1):
        raise InputError(f"threshold = {threshold!r}: must be from 0 to 1, a force over the mean contact force")
    found = Contacts(*_contacts_of_all(packing), packing)
    if not threshold:
        return found
    size = found.forces.size
    counted = size * len(size) >= threshold * size.sum()
    rattlers, bearing = _rattlers(packing, found.pairs[counted], packing.kind.places(packing)[counted])
    counted[counted] = bearing
    return replace(found, rattlers=rattlers, bearing=counted)


@per_packing
def _contacts_of_all(packing: Packing) -> tuple[Indices, NDArray[np.bool_], NDArray[np.bool_], Array, Indices]:
    """First five attributes of `Contacts`, whatever their force."""
    near = packing.kind.pairs(packing)
    pairs = np.column_stack([near.i, near.j])
    return pairs, *_rattlers(packing, pairs, packing.kind.places(packing)), near.r, near.shift


def _rattlers(packing: Packing, pairs: Indices, places: Indices) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """See `find_rattlers`."""
    free = packing.frame.free
    rattlers, bearing = find_rattlers(pairs, free, packing.law.least_contacts, places)
    return rattlers, bearing & free[pairs].any(axis=1)


STRONG = 3e-4  # of the mean force: least of contacts at onset that are no stops of sliding droplets, see quantities.md


def count_strong(packing: Packing) -> dict[str, float]:
    """z and rattlers without weaker contacts, as an observable of a campaign: columns of "states"."""
    network = contacts(packing, threshold=STRONG)
    return {"z_strong": network.z, "rattlers_strong": float(network.rattlers.sum())}


@checked
def remove_rattlers(packing: Packing) -> Packing:
    """Return the packing without rattlers; its voids are the faces of the contact network.

    Do not use it before linear response, which ignores rattlers anyway: without them the mean particle size differs,
    and so does the drag in units "eps".

    Args:
        packing: SP or DP.

    Raises:
        InputError: every particle is a rattler.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-3, seed=3)
        >>> backbone = jamlab.remove_rattlers(p)
        >>> p.n - backbone.n == int(jamlab.contacts(p).rattlers.sum())
        True
    """
    kept = ~contacts(packing).rattlers
    if not kept.any():
        raise InputError("every particle is a rattler, so no particle would remain: give a jammed packing")
    return changed(packing, packing.select(kept), "remove_rattlers")


def contacts_are_certain(packing: Packing) -> bool:
    """Whether the rounding of positions, `Packing.rounding`, can neither open nor close a contact. Both coordinates of
    both ends may be off, so a gap by 2 sqrt(2) times as much: particles that much larger and smaller must touch the
    same others."""
    if not packing.rounding:
        return True
    wider, narrower = (packing.kind.grown(packing, growth) for growth in (3 * packing.rounding, -3 * packing.rounding))
    if wider is None or narrower is None:
        return False
    return np.array_equal(contacts(wider).pairs, contacts(narrower).pairs)


def contact_lines(network: Contacts) -> Array:
    """(m, 2, 2) from the centre of i, moved into the cell, to the centre of the touching image of j."""
    from jamlab.packing.packing_plot import home_moves

    packing = network.packing
    starts = (packing.centroids + home_moves(packing))[network.pairs[:, 0]]
    return np.stack([starts, starts + network.r], axis=1)
