"""Energy, forces, stress, packing fraction, and moduli of disks, from nothing but the definitions: what maps judge by.

Every pair of particles in every periodic image is looked at, without neighbour lists, LAMMPS, compiled loops or
`jamlab.mechanics`. Derivatives that are not written out are taken by complex steps, Im f(x + ih)/h, which lose no
digits; Squire & Trapp, SIAM Rev. 40, 110 (1998). Meant for tens of particles.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import affinity

from jamlab.packing.packing import Packing

Array = NDArray[Any]  # float64, extended precision, or complex128 on a complex step

STEP = 1e-30  # of complex steps: no difference is taken, so it can be this small
_LEAST_CONTACTS = 3  # of a disk that is held
_NO_STIFFNESS = 1e-13  # of the largest eigenvalue: translations leave 1e-16 and less


def plain_forces(packing: Packing) -> tuple[float, Array]:
    """Energy, and (n_sites, 2) forces, in time and memory that grow as the square of the number of sites."""
    energy, forces = energy_and_forces(packing, packing.positions, packing.box)
    return float(energy), forces


def plain_stress(packing: Packing) -> Array:
    """(2, 2) stress -(1/A) dU/dE, positive in compression, by complex steps of the energy."""
    stress = np.empty((2, 2))
    for k, m in np.ndindex(2, 2):
        stretch = np.eye(2, dtype=np.complex128)
        stretch[k, m] += 1j * STEP
        energy, _ = energy_and_forces(packing, packing.positions @ stretch.T, packing.box @ stretch.T)
        stress[k, m] = -energy.imag / STEP / packing.area
    return stress


def plain_max_force(packing: Packing) -> float:
    """Largest norm of a force."""
    return float(np.hypot(*plain_forces(packing)[1].T).max())


def plain_pressure(packing: Packing) -> float:
    """Half the trace of the stress."""
    return float(0.5 * np.trace(plain_stress(packing)))


def plain_packing_fraction(packing: Packing) -> float:
    """Area of the union of all disks, or of all droplets with their rims, over the area of the cell; right to 1e-4.
    Outlines are polygons of 256 sides, of the area of the disk."""
    quarter = 64
    if packing.model == "sp":
        assert packing.diameters is not None
        turn = np.pi / (2 * quarter)
        equal = np.sqrt(turn / np.sin(turn))
        shapes = shapely.buffer(shapely.points(packing.positions), 0.5 * packing.diameters * equal, quad_segs=quarter)
    else:
        assert packing.offsets is not None
        rings = np.split(packing.positions, packing.offsets[1:-1])
        shapes = shapely.buffer(
            [shapely.Polygon(ring) for ring in rings], 0.5 * packing.params["delta"], quad_segs=quarter
        )
    box = packing.box
    lattice = np.floor(np.linalg.solve(box.T, shapely.get_coordinates(shapely.centroid(shapes)).T).T)
    copies = []
    for shape, home in zip(shapes, lattice, strict=True):
        for image in np.ndindex(3, 3):
            copies.append(affinity.translate(shape, *((np.array(image) - 1 - home) @ box)))
    cell = shapely.Polygon([np.zeros(2), box[0], box[0] + box[1], box[1]])
    return float(shapely.intersection(shapely.union_all(copies), cell).area / packing.area)


def energy_and_forces(packing: Packing, positions: Array, box: Array) -> tuple[Any, Array]:
    """Energy and (n_sites, 2) forces at other positions in another box, complex ones on a complex step."""
    if packing.model == "sp":
        return _disks(packing, positions, box)
    bare, forces = _bare_droplets(packing, positions)
    contact, pushes = droplet_contacts(packing, positions, box)
    return bare + contact, forces + pushes


# disks ----------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Touching:
    """Disks that touch, each contact from both sides."""

    # i, j: (m,) disks
    i: NDArray[np.int64]
    j: NDArray[np.int64]
    r: Array  # (m, 2) from j to i
    reach: Array  # (m,) sum of radii


def touching_disks(packing: Packing, positions: Array, box: Array) -> Touching:
    """Disks that touch at other positions in another box, in any periodic image."""
    assert packing.diameters is not None
    reach = 0.5 * (packing.diameters[:, None] + packing.diameters[None, :])
    found = []
    nearest, images = _differences(positions, box, float(reach.max()))
    for a, b in images:
        r = nearest + a * box[0] + b * box[1]
        touch = np.einsum("ijk,ijk->ij", r.real, r.real) < reach**2
        if not (a or b):
            np.fill_diagonal(touch, False)
        i, j = np.nonzero(touch)
        found.append((i, j, r[i, j], reach[i, j]))
    return Touching(*(np.concatenate(parts) for parts in zip(*found, strict=True)))


def _disks(packing: Packing, positions: Array, box: Array) -> tuple[Any, Array]:
    found = touching_disks(packing, positions, box)
    distance = np.sqrt(found.r[:, 0] ** 2 + found.r[:, 1] ** 2)
    stiffness = spring(packing, found.reach)
    overlap = found.reach - distance
    forces = np.zeros_like(positions)
    np.add.at(forces, found.i, (stiffness * overlap / distance)[:, None] * found.r)
    return 0.25 * np.sum(stiffness * overlap**2), forces


def spring(packing: Packing, reach: Array) -> Array:
    """Stiffness of contacts: k, or eps/s^2 in the law of Boromand et al. eq 5."""
    if packing.units == "k":
        return np.full(len(reach), float(packing.params["k"]))
    return np.asarray(packing.params["eps"] / reach**2)


def _differences(points: Array, box: Array, reach: float) -> tuple[Array, list[tuple[int, int]]]:
    """(m, m, 2) vectors from j to i by the nearest lattice vector, and the images besides that may lie within reach."""
    difference = points[:, None, :] - points[None, :, :]
    lattice = np.round(np.linalg.solve(box.real.T, difference.real.reshape(-1, 2).T).T).reshape(difference.shape)
    area = box[0, 0].real * box[1, 1].real
    heights = area / np.array([np.hypot(*box[1].real), np.hypot(*box[0].real)])
    a, b = (int(np.floor(reach / height + 0.5)) for height in heights)
    images = [(p, q) for p in range(-a, a + 1) for q in range(-b, b + 1)]
    return difference - lattice @ box, images


# droplets -------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Feet:
    """Every vertex against every edge in one periodic image; (v, e) arrays."""

    distance: Array  # from the vertex to the nearest point of the edge
    r: Array  # (v, e, 2) from that point to the vertex
    place: Array  # of the point, from tail (0) to head (1)


def droplet_contacts(packing: Packing, positions: Array, box: Array) -> tuple[Any, Array]:
    """Energy and forces of contacts between droplets, also with their own images."""
    offsets, count, owner, after = packing.offsets, packing.n, packing.particle, packing.polygons.successor
    assert offsets is not None
    forces = np.zeros_like(positions)
    energy: Any = 0.0
    centres = np.array([positions[offsets[m] : offsets[m + 1]].mean(axis=0) for m in range(count)])
    radius = max(np.hypot(*(positions.real - centres.real[owner]).T).max(), 0.0)
    nearest, images = _differences(centres, box, 2 * float(radius) + float(packing.params["delta"]))
    shift = nearest - (centres[:, None, :] - centres[None, :, :])
    feet = {}
    for a, b in images:
        moved = shift + a * box[0] + b * box[1]
        feet[a, b] = _find_feet(positions, positions[after] - positions, moved[owner[:, None], owner[None, :]])
    for (a, b), here in feet.items():
        foreign = np.ones((count, count), dtype=bool) if (a or b) else ~np.eye(count, dtype=bool)
        if packing.params["contact"] == "outline":
            close = _nearest_edges(here, foreign, offsets, owner)
        elif packing.params["contact"] == "segment/smooth":
            v, e = np.nonzero(foreign[owner[:, None], owner[None, :]])
            close = v, e
        else:
            half = [(m, o) for m, o in np.argwhere(foreign) if (m, a, b) > (o, -a, -b)]
            for m, o in half:
                energy += _nearest_of_four(packing, (here, feet[-a, -b]), (m, o), forces)
            continue
        energy += _push(packing, here, *close, forces)
    return energy, forces


def _bare_droplets(packing: Packing, positions: Array) -> tuple[Any, Array]:
    assert packing.offsets is not None
    forces = np.zeros_like(positions)
    gamma, ka, eta = (float(packing.params[name]) for name in ("gamma", "ka", "eta"))
    energy: Any = 0.0
    for m, (first, last) in enumerate(pairwise(packing.offsets)):
        x = positions[first:last]
        ahead, behind = np.roll(x, -1, axis=0), np.roll(x, 1, axis=0)
        edge = ahead - x
        length = np.sqrt(edge[:, 0] ** 2 + edge[:, 1] ** 2 + eta**2)
        area = 0.5 * np.sum(x[:, 0] * ahead[:, 1] - ahead[:, 0] * x[:, 1])
        excess = area - packing.params["a0"][m]
        energy = energy + gamma * np.sum(length) + 0.5 * ka * excess**2
        pull = gamma * edge / np.where(length.real > 0, length, 1.0)[:, None]
        chord = ahead - behind
        forces[first:last] += pull - np.roll(pull, 1, axis=0)
        forces[first:last] -= 0.5 * ka * excess * np.column_stack([chord[:, 1], -chord[:, 0]])
    return energy, forces


def _find_feet(positions: Array, edge: Array, shift: Array) -> _Feet:
    """Feet of all vertices on all edges; shift (v, e, 2) brings the vertex into the image of the edge."""
    along = positions[:, None, :] - positions[None, :, :] + shift
    square = edge[:, 0] ** 2 + edge[:, 1] ** 2
    place = np.einsum("vek,ek->ve", along, edge) / np.where(square.real > 0, square, 1.0)
    place = np.where(place.real <= 0, 0.0, np.where(place.real >= 1, 1.0, place))
    r = along - place[..., None] * edge
    return _Feet(np.sqrt(r[..., 0] ** 2 + r[..., 1] ** 2), r, place)


def _nearest_edges(here: _Feet, foreign: Array, offsets: Array, owner: Array) -> tuple[Array, Array]:
    """Vertices and the edge of every other polygon that is nearest to each."""
    vertices, edges = [], []
    for m, (first, last) in enumerate(pairwise(offsets)):
        v = np.flatnonzero(foreign[owner, m])
        vertices.append(v)
        edges.append(first + here.distance[v, first:last].real.argmin(axis=1))
    return np.concatenate(vertices), np.concatenate(edges)


def _push(packing: Packing, here: _Feet, v: Array, e: Array, forces: Array) -> Any:
    """Energy of vertices v on edges e, eps/2 (1 - d/delta)^2 each; adds to the forces."""
    delta, eps = float(packing.params["delta"]), float(packing.params["eps"])
    near = here.distance[v, e].real < delta
    v, e = v[near], e[near]
    distance, t = here.distance[v, e], here.place[v, e][:, None]
    force = (eps / delta * (1 - distance / delta) / distance)[:, None] * here.r[v, e]
    np.add.at(forces, v, force)
    np.subtract.at(forces, e, (1 - t) * force)
    np.subtract.at(forces, packing.polygons.successor[e], t * force)
    return 0.5 * eps * np.sum((1 - distance / delta) ** 2)


def _nearest_of_four(packing: Packing, both: tuple[_Feet, _Feet], pair: tuple[int, int], forces: Array) -> Any:
    """Energy of all pairs of edges of two polygons, Boromand et al. eq 8: of four feet only the nearest counts."""
    assert packing.offsets is not None
    here, back = both
    one, two = (np.arange(packing.offsets[m], packing.offsets[m + 1]) for m in pair)
    e, f = (grid.ravel() for grid in np.meshgrid(one, two, indexing="ij"))
    after = packing.polygons.successor
    ends = [(here, e, f), (here, after[e], f), (back, f, e), (back, after[f], e)]
    least = np.argmin([feet.distance[v, edge].real for feet, v, edge in ends], axis=0)
    energy: Any = 0.0
    for k, (feet, v, edge) in enumerate(ends):
        energy += _push(packing, feet, v[least == k], edge[least == k], forces)
    return energy


# moduli of disks, static and over frequency: dense matrices by complex steps and plain loops --------------------------


def plain_hessian(packing: Packing) -> Array:
    """(2n + 4, 2n + 4) second derivatives of the energy of disks, by complex steps of the forces. Coordinates: x and y
    of every disk, then the displacement gradient E_xx, E_xy, E_yx, E_yy of box and disks."""
    size = packing.positions.size
    columns = [(np.zeros((2, 2)), site) for site in np.eye(size).reshape(size, -1, 2)]
    columns += [(np.eye(4)[k].reshape(2, 2), np.zeros_like(packing.positions)) for k in range(4)]
    hessian = np.empty((size + 4, size + 4))
    for column, (gradient, shift) in enumerate(columns):
        stretch = np.eye(2) + 1j * STEP * gradient
        positions = packing.positions @ stretch.T + 1j * STEP * shift
        _, forces = energy_and_forces(packing, positions, packing.box @ stretch.T)
        hessian[:size, column] = -forces.imag.ravel() / STEP
    hessian[size:, :size] = hessian[:size, size:].T
    hessian[size:, size:] = _affine_stiffness(packing)
    return hessian


def plain_moduli(packing: Packing) -> Array:
    """(2, 2, 2, 2) relaxed elastic tensor of disks at an energy minimum without rattlers, by a dense pseudo-inverse."""
    packing = without_loose_disks(packing)
    size = packing.positions.size
    hessian = plain_hessian(packing)
    values, modes = np.linalg.eigh(hessian[:size, :size])
    soft = values < _NO_STIFFNESS * values[-1]
    if soft.sum() != 2:
        raise np.linalg.LinAlgError(f"{soft.sum()} modes without stiffness, translations are 2")
    along = modes[:, ~soft].T @ hessian[:size, size:]
    relaxed = hessian[size:, size:] - along.T @ (along / values[~soft, None])
    return np.asarray(relaxed.reshape(2, 2, 2, 2) / packing.area)


def plain_shear_modulus(packing: Packing) -> float:
    """G of disks for simple shear along x."""
    return float(plain_moduli(packing)[0, 1, 0, 1])


def _affine_stiffness(packing: Packing) -> Array:
    """(4, 4) d2U/dE dE of disks: of every contact, force law and direction written out."""
    found = touching_disks(packing, packing.positions, packing.box)
    r, s = found.r, found.reach
    distance = np.hypot(*r.T)
    stiffness, push = spring(packing, s), spring(packing, s) * (s - distance)
    n = r / distance[:, None]
    across = np.eye(2)[None] - n[:, :, None] * n[:, None, :]
    second = stiffness[:, None, None] * n[:, :, None] * n[:, None, :] - (push / distance)[:, None, None] * across
    # half: every contact is found from both its sides
    return np.asarray(0.5 * np.einsum("mik,mj,ml->ijkl", second, r, r).reshape(4, 4))


def without_loose_disks(packing: Packing) -> Packing:
    """Take out disks with fewer than three contacts, again and again."""
    found = touching_disks(packing, packing.positions, packing.box)
    held = np.ones(packing.n, dtype=bool)
    while True:
        bearing = held[found.i] & held[found.j]
        few = held & (np.bincount(found.i[bearing], minlength=packing.n) < _LEAST_CONTACTS)
        if not few.any():
            break
        held &= ~few
    if not held.any():
        raise np.linalg.LinAlgError("no disk is held")
    return packing.select(held)


def plain_drag(packing: Packing, beta: float = 1.0, background: float = 0.0) -> Array:
    """(3n + 1, 3n + 1) damping matrix of disks, tau_1 = 1, Baumgarten & Tighe eqs 5 and 6, arms = radii. Coordinates:
    velocities beside the affine flow, angular velocities, rate of x -> x + gamma y. Background: drag of every disk
    against the affine flow, over k tau_1."""
    assert packing.diameters is not None
    n, found = packing.n, touching_disks(packing, packing.positions, packing.box)
    total = np.zeros((3 * n + 1, 3 * n + 1))
    for i, j, r, s in zip(found.i, found.j, found.r, found.reach, strict=True):
        normal = r / np.hypot(*r)
        for direction, weight in ((normal, 1.0), (np.array([-normal[1], normal[0]]), beta)):
            row = np.zeros(3 * n + 1)
            row[2 * i : 2 * i + 2] += direction
            row[2 * j : 2 * j + 2] -= direction
            row[-1] = r[1] * direction[0]
            if direction is not normal:
                row[2 * n + i] -= 0.5 * packing.diameters[i]
                row[2 * n + j] -= 0.5 * packing.diameters[j]
            stiffness = float(spring(packing, np.array([s]))[0])
            total += 0.5 * weight * stiffness * np.outer(row, row)  # half: found from both sides
    size = 1.0 if packing.units == "k" else packing.diameters.mean()
    total[: 2 * n, : 2 * n] += background * packing.params[packing.units] / size**2 * np.eye(2 * n)
    return total


def plain_complex_modulus(packing: Packing, omega: float, beta: float = 1.0) -> complex:
    """G* of disks without rattlers, simple shear along x, contact damping: dense elimination in extended precision."""
    packing = without_loose_disks(packing)
    n = packing.n
    shear = np.r_[0 : 2 * n, 2 * n + 1]  # of E only E_xy
    k = np.zeros((3 * n + 1, 3 * n + 1))
    used = np.r_[0 : 2 * n, 3 * n]
    k[np.ix_(used, used)] = plain_hessian(packing)[np.ix_(shear, shear)]
    matrix = k.astype(np.clongdouble) + 1j * np.longdouble(omega) * plain_drag(packing, beta)
    if beta == 0:  # rotations meet no drag
        matrix[range(2 * n, 3 * n), range(2 * n, 3 * n)] = 1.0
    return complex(_eliminate(matrix[2:, 2:]) / np.longdouble(packing.area))


def _eliminate(matrix: Array) -> Any:
    """The last element after elimination of all others, the largest pivot of a column first."""
    matrix = matrix.copy()
    last = len(matrix) - 1
    for k in range(last):
        best = k + int(np.abs(matrix[k:last, k]).argmax())
        matrix[[k, best]] = matrix[[best, k]]
        matrix[k + 1 :, k:] -= np.outer(matrix[k + 1 :, k] / matrix[k, k], matrix[k, k:])
    return matrix[last, last]
