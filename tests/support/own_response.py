"""Static response by plain numpy that shares nothing with the package: contacts by brute force over images, energies
written anew, their second derivatives by differences of complex steps, relaxation by eigenmodes of the dense Hessian.

Strains act through a map of its own: free sites and fixed disks go to F x, fixed droplets keep their area, walls keep
their shape, and every image of a particle is a lattice vector F b away.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from outlines import feet

SIMPLE, ALONG_Y = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0, 0.0], [0.0, 1.0]])
PURE, ISOTROPIC = np.diag([0.5, -0.5]), 0.5 * np.eye(2)
FLOPPY = 1e-9  # eigenvalue over the largest one


def simple_along(angle):
    """Generator of simple shear along an angle, radian."""
    a, b = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    return np.outer(a, b)


def exponential(m, g):
    """(2, 2) exp(g m) to the third order."""
    return np.eye(2) + g * m + g**2 / 2 * m @ m + g**3 / 6 * m @ m @ m


# energies ------------------------------------------------------------------------------------------------------------


def norm(r):
    """Length without abs, so that complex steps go through."""
    return np.sqrt(r[..., 0] ** 2 + r[..., 1] ** 2)


def disk_energy(p, s, overlap):
    """(k,) energy of contacts at distance s, of overlap x, which may be complex."""
    params = p.params
    k = params["k"] if "k" in params else params["eps"] / s**2
    if a := params.get("stickiness", 0.0) * p.diameters[p.diameters > 0].mean():
        return np.where(overlap.real > -a, k / 2 * (overlap**2 - 2 * a**2), -k / 2 * (overlap + 2 * a) ** 2)
    alpha = params.get("exponent", 2.0)
    return k * s**2 / alpha * (overlap / s) ** alpha


@dataclass
class Term:
    """Energies of one kind: `energy` of positions (..., k, m, 2) of sites (k, m), each `shift` (k, m, 2) away."""

    sites: np.ndarray
    shift: np.ndarray
    energy: object


def images(box, reach):
    """(m, 2) lattice vectors of a box that leans least."""
    box = np.array(box)
    box[1] -= np.round(box[1, 0] / box[0, 0]) * box[0]
    i, j = np.meshgrid(np.arange(-reach, reach + 1), np.arange(-reach, reach + 1))
    return np.column_stack([i.ravel(), j.ravel()]) @ box


def nearest(r, box):
    """Lattice vectors that bring separations r near zero."""
    back = np.zeros_like(r)
    for row in (1, 0):
        back -= np.outer(np.round((r + back)[:, row] / box[row, row]), box[row])
    return back


def disk_terms(p):
    """Pairs of disks that act on each other, each image, and disks on flat walls."""
    d, x, box = p.diameters, p.positions, np.array(p.box)
    shell = 2 * p.params.get("stickiness", 0.0) * d[d > 0].mean()
    i, j = (index.ravel() for index in np.indices((p.n, p.n)))
    kept = (i <= j) & (d[i] > 0)
    i, j = i[kept], j[kept]
    around = nearest(x[j] - x[i], box)
    found = []
    for vector in images(box, 2 if p.n < 5 else 1):
        r = x[j] - x[i] + around + vector
        line = d[j] == 0
        distance = np.where(line, np.abs(r[:, 1]), np.hypot(*r.T))
        near = distance < 0.5 * (d[i] + d[j]) * (1 - 1e-12) + shell  # rattlers are left just touching
        near &= ~line | (np.abs(vector[0]) < 0.6 * box[0, 0])  # a line once
        near &= (i < j) | (vector[1] > 0) | ((vector[1] == 0) & (vector[0] > 0))  # its own images by halves
        found += [(a, b, *(around[k] + vector)) for k, a, b in zip(np.flatnonzero(near), i[near], j[near], strict=True)]
    lines = {(int(a), int(b), round(sy, 9)): (a, b, sx, sy) for a, b, sx, sy in found if d[int(b)] == 0}
    found = [each for each in found if d[int(each[1])] > 0] + list(lines.values())
    table = np.array(found).reshape(-1, 4)
    sites, vectors = table[:, :2].astype(int), table[:, 2:]
    s, line = 0.5 * d[sites].sum(axis=1), d[sites[:, 1]] == 0

    def energy(z):
        r = z[..., 1, :] - z[..., 0, :]
        sign = np.where(r[..., 1].real < 0, -1.0, 1.0)
        return disk_energy(p, s, s - np.where(line, sign * r[..., 1], norm(r)))

    found = [Term(sites, np.stack([np.zeros_like(vectors), vectors], axis=1), energy)]
    return found if len(sites) else []


def closest_points(p, vertices, owner, after):
    """Closest points of outlines within a rim's width of vertices, each with the lattice vector to its image: (k, 4)
    vertex and vertex, (m, 5) vertex and both ends of an edge. `owner`: droplet of a site; `after`: next site of it."""
    x, box, delta = p.positions, np.array(p.box), p.params["delta"]
    to_point, to_line = [], []
    for v in vertices:
        for m in range(p.n):
            if p.offsets[m + 1] - p.offsets[m] == 1:
                continue
            a = np.arange(p.offsets[m], p.offsets[m + 1])
            b = after[a]
            centre = x[a].mean(axis=0)
            vectors = nearest((centre - x[v])[None], box) + images(box, 1)
            reach = np.hypot(*(x[a] - centre).T).max() + delta  # no outline is near beyond
            vectors = vectors[np.hypot(*(centre + vectors - x[v]).T) < reach]
            if m == owner[v]:
                vectors = vectors[np.hypot(*vectors.T) > 0.1 * box[0, 0]]  # its images alone
            for s in vectors:
                tail, along = x[a] + s, x[b] - x[a]
                distance, _, t = (found[0] for found in feet(x[v][None], tail, tail + along))
                k = distance.argmin()
                if distance[k] >= delta:
                    continue
                if 0 < t[k] < 1:
                    to_line.append((v, a[k], b[k], *s))
                else:
                    to_point.append((v, (a if t[k] == 0 else b)[k], *s))
    return np.array(to_point).reshape(-1, 4), np.array(to_line).reshape(-1, 5)


def droplet_terms(p):
    """Line tension, areas, and each vertex with the closest point of each other outline."""
    x, box, q, delta = p.positions, np.array(p.box), p.params, p.params["delta"]
    owner = np.repeat(np.arange(p.n), np.diff(p.offsets))
    after = np.arange(len(x)) + 1
    after[p.offsets[1:] - 1] = p.offsets[:-1]
    wall = (np.diff(p.offsets) == 1)[owner]
    edge = np.flatnonzero(~wall)
    none = np.zeros((1, 1, 2))
    terms = [Term(np.column_stack([edge, after[edge]]), none, lambda z: q["gamma"] * norm(z[..., 1, :] - z[..., 0, :]))]
    for count in np.unique(np.diff(p.offsets)):
        rings = np.flatnonzero(np.diff(p.offsets) == count)
        if count > 1:
            a0 = q["a0"][rings]
            sites = p.offsets[rings][:, None] + np.arange(count)
            terms.append(Term(sites, none, lambda z, a0=a0: q["ka"] / 2 * (ring_area(z) - a0) ** 2))
    point, line = closest_points(p, edge, owner, after)
    push = lambda distance: q["eps"] / 2 * (1 - distance / delta) ** 2  # noqa: E731
    vector = np.stack([np.zeros((len(point), 2)), point[:, 2:]], axis=1)
    terms.append(Term(point[:, :2].astype(int), vector, lambda z: push(norm(z[..., 1, :] - z[..., 0, :]))))
    vector = np.stack([np.zeros((len(line), 2)), line[:, 3:], line[:, 3:]], axis=1)
    terms.append(Term(line[:, :3].astype(int), vector, lambda z: push(line_distance(z))))
    flat = [
        (v, w, 0.0, m * box[1, 1])
        for v in edge
        for w in np.flatnonzero(wall)
        for m in (-1, 0, 1)
        if abs(x[w, 1] + m * box[1, 1] - x[v, 1]) < delta
    ]
    table = np.array(flat).reshape(-1, 4)
    vector = np.stack([np.zeros((len(table), 2)), table[:, 2:]], axis=1)
    # either sign: the square of the height
    height = lambda z: np.sqrt((z[..., 1, 1] - z[..., 0, 1]) ** 2)  # noqa: E731
    terms.append(Term(table[:, :2].astype(int), vector, lambda z: push(height(z))))
    return [term for term in terms if len(term.sites)]


def ring_area(z):
    """Area of polygons (..., m, 2)."""
    w = np.roll(z, -1, axis=-2)
    return 0.5 * (z[..., 0] * w[..., 1] - z[..., 1] * w[..., 0]).sum(axis=-1)


def line_distance(z):
    """Distance of the first of three points from the line through the others, complex steps allowed."""
    v, e = z[..., 0, :] - z[..., 1, :], z[..., 2, :] - z[..., 1, :]
    c = v[..., 0] * e[..., 1] - v[..., 1] * e[..., 0]
    return np.sqrt(c**2) / norm(e)


# derivatives ---------------------------------------------------------------------------------------------------------


class Own:
    """Own numbers of a packing."""

    def __init__(self, p):
        self.p, self.n, self._found = p, len(p.positions), {}
        self.area = float(np.linalg.det(p.box))
        self.terms = disk_terms(p) if p.model == "sp" else droplet_terms(p)
        self.fixed = np.zeros(p.n, dtype=bool) if p.fixed is None else np.array(p.fixed)
        owner = np.arange(p.n) if p.offsets is None else np.repeat(np.arange(p.n), np.diff(p.offsets))
        self.free = np.repeat(~self.fixed[owner], 2)
        self.centres = p.positions if p.offsets is None else self._centres()[owner]
        self.held = self.fixed[owner]
        self.step = 1e-5 * np.sqrt(self.area / p.n)

    def _centres(self):
        """Area centroids of the polygons."""
        found = []
        for ring in np.split(self.p.positions, self.p.offsets[1:-1]):
            if len(ring) < 3:
                found.append(ring.mean(axis=0))
                continue
            x, y = (ring - ring[0]).T
            x1, y1 = np.roll(x, -1), np.roll(y, -1)
            c = x * y1 - x1 * y
            found.append(ring[0] + np.array([((x + x1) * c).sum(), ((y + y1) * c).sum()]) / (3 * c.sum()))
        return np.array(found)

    def carried(self, f):
        """(n_sites, 2) positions after F."""
        p, x = self.p, self.p.positions
        moved = x @ f.T
        if p.walls:
            height = p.box[1, 1]
            h = height * np.round(self.centres[:, 1] / height)
            rigid = x + np.column_stack([f[0, 1] * h, (f[1, 1] - 1) * h])
            moved[self.held] = rigid[self.held]
        elif p.model == "dp":
            kept = self.centres @ f.T + (x - self.centres) @ f.T / np.sqrt(np.linalg.det(f))
            moved[self.held] = kept[self.held]
        return moved

    def of_strain(self, m):
        """For every term (k, m, 2): first and second derivative of the positions of its images along exp(g m)."""
        return self._once("strain", m, self._of_strain)

    def _of_strain(self, m):
        g = 1e-3
        f = [exponential(m, s * g) for s in (-2, -1, 1, 2)]
        out = []
        for term in self.terms:
            here = self.p.positions[term.sites] + term.shift
            x = [self.carried(each)[term.sites] + term.shift @ each.T for each in f]
            first = (8 * (x[2] - x[1]) - (x[3] - x[0])) / (12 * g)
            second = (16 * (x[1] + x[2]) - (x[0] + x[3]) - 30 * here) / (12 * g**2)
            out.append((first, second))
        return out

    def _at(self, term):
        return (self.p.positions[term.sites] + term.shift).astype(complex)

    @cached_property
    def energy(self):
        """Total energy."""
        return float(sum(term.energy(self._at(term)).real.sum() for term in self.terms))

    def _slope(self, term, z):
        """(k, 2 m) gradient of a term at z."""
        axes = np.eye(2 * term.sites.shape[1]).reshape(-1, 1, *term.sites.shape[1:], 2)
        return term.energy(z + 1e-30j * axes).imag.T / 1e-30

    @cached_property
    def slopes(self):
        """For every term: gradient (k, 2 m)."""
        return [self._slope(term, self._at(term)) for term in self.terms]

    @cached_property
    def blocks(self):
        """For every term: Hessian (k, 2 m, 2 m), by differences of the fourth order."""
        found, weights = [], ((-2, 1), (-1, -8), (1, 8), (2, -1))
        for term in self.terms:
            k, m = term.sites.shape
            axes = self.step * np.eye(2 * m).reshape(-1, m, 2)
            columns = [sum(w * self._slope(term, self._at(term) + a * s) for s, w in weights) for a in axes]
            found.append(np.stack(columns, axis=2).reshape(k, 2 * m, 2 * m) / (12 * self.step))
        return found

    def _places(self, term):
        return (2 * term.sites[:, :, None] + np.arange(2)).reshape(len(term.sites), -1)

    @cached_property
    def gradient(self):
        """(n_sites, 2) dU/dx of all sites."""
        out = np.zeros(2 * self.n)
        for term, slope in zip(self.terms, self.slopes, strict=True):
            np.add.at(out, self._places(term), slope)
        return out.reshape(-1, 2)

    @cached_property
    def hessian(self):
        """(2 n_sites, 2 n_sites) of all sites; fixed ones have none."""
        out = np.zeros((2 * self.n, 2 * self.n))
        for term, block in zip(self.terms, self.blocks, strict=True):
            at = self._places(term)
            np.add.at(out, (at[:, :, None], at[:, None, :]), block)
        return out * np.outer(self.free, self.free)

    def along(self, m):
        """d2U/dg2 and d2U/du dg of the strain exp(g m)."""
        return self._once("along", m, self._along)

    def _once(self, name, m, function):
        """What a function gives of a generator, found once for each."""
        key = name, np.asarray(m, dtype=float).tobytes()
        return self._found[key] if key in self._found else self._found.setdefault(key, function(m))

    def _along(self, m):
        second, mixed = 0.0, np.zeros(2 * self.n)
        for term, slope, block, x in zip(self.terms, self.slopes, self.blocks, self.of_strain(m), strict=True):
            x1, x2 = (each.reshape(len(each), -1) for each in x)
            pulled = np.einsum("kab,kb->ka", block, x1)
            second += (pulled * x1).sum() + (slope * x2).sum()
            np.add.at(mixed, self._places(term), pulled)
        return second, mixed * self.free

    @cached_property
    def modes(self):
        """Eigenvalues and modes of the free sites."""
        return np.linalg.eigh(self.hessian[self.free][:, self.free])

    @cached_property
    def least_stiff(self):
        """Eigenvalue below which a mode is floppy."""
        largest = max(np.abs(block).max() for block in self.blocks)
        return FLOPPY * max(largest, np.abs(self.modes[0]).max(initial=0.0))

    def response(self, m):
        """(n_sites, 2) du/dg of the free sites, the least one."""
        return self._once("response", m, self._response)

    def _response(self, m):
        values, vectors = self.modes
        stiff = np.abs(values) > self.least_stiff
        load = self.along(m)[1][self.free] @ vectors[:, stiff]
        out = np.zeros(2 * self.n)
        out[self.free] = -vectors[:, stiff] @ (load / values[stiff])
        return out.reshape(-1, 2)

    def stress(self, m):
        """dU/dg/A: shear stress conjugate to exp(g m), tension positive."""
        moved = [x1.reshape(len(x1), -1) for x1, _ in self.of_strain(m)]
        return sum((slope * x).sum() for slope, x in zip(self.slopes, moved, strict=True)) / self.area

    def modulus(self, m, affine=False):
        """d2U/dg2/A along exp(g m), the sites relaxed."""
        second, mixed = self.along(m)
        taken = 0.0 if affine else self.response(m).ravel() @ mixed
        return float(second + taken) / self.area

    @property
    def squeeze(self):
        """Generator of the compression, of trace 1."""
        return ALONG_Y if self.p.walls else ISOTROPIC

    @property
    def pressure(self):
        """-dU/dA."""
        return -self.stress(self.squeeze)

    @property
    def stiffness(self):
        """Scale of moduli."""
        return self.bulk(affine=True)

    def bulk(self, affine=False):
        """-A dp/dA, of p = -(dU/de)/A at an area exp(e)."""
        return self.modulus(self.squeeze, affine) + self.pressure

    def bulk_of_box(self):
        """The same in a box without shear stress, which shears as it is compressed: along with the two shears."""
        strains = (ISOTROPIC, PURE, 0.5 * (SIMPLE + SIMPLE.T))
        single = [self.modulus(m) for m in strains]
        q = np.array(
            [
                [(self.modulus(a + b) - x - y) / 2 for b, y in zip(strains, single, strict=True)]
                for a, x in zip(strains, single, strict=True)
            ]
        )
        return float(q[0, 0] - q[0, 1:] @ np.linalg.solve(q[1:, 1:], q[1:, 0])) + self.pressure
