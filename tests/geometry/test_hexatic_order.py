"""Bond-orientational order: perfect lattices, invariance, an own loop over a large patch of copies, random points."""

import numpy as np
import pytest
from scipy.spatial import Delaunay

import jamlab
from jamlab import hexatic_order

TRIANGULAR = np.array([[1.0, 0.0], [0.5, np.sqrt(0.75)]])


def packed(points, box):
    """Points as disks of a size that does not matter."""
    return jamlab.Packing("sp", box, points, {"k": 1.0}, "k", np.full(len(points), 0.1))


def lattice(rows, columns, cell):
    """rows x columns points of a lattice, a little off the corner of the box."""
    steps = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).reshape(-1, 2)
    return packed((steps + np.array([0.13, 0.27])) @ cell, np.diag([columns, rows]) @ cell)


def random_points(n=40, seed=0, tilt=0.4):
    """Random points in a tilted box, some outside it."""
    rng = np.random.default_rng(seed)
    box = np.sqrt(n) * np.array([[1.1, 0.0], [tilt, 1 / 1.1]])
    return packed(rng.uniform(-0.3, 1.3, (n, 2)) @ box, box)


def own_order(p, k, copies=5):
    """psi_k and neighbours of each point in the middle of copies x copies cells, by walking around triangles."""
    corner = np.linalg.solve(p.box.T, p.positions.T).T
    wrapped = (corner - np.floor(corner)) @ p.box
    images = [(np.array(s) - copies // 2) @ p.box for s in np.ndindex(copies, copies)]
    middle = copies**2 // 2
    patch = np.concatenate([wrapped + s for s in images])
    start, around = Delaunay(patch).vertex_neighbor_vertices
    psi, count = np.zeros(p.n, complex), np.zeros(p.n, int)
    for i in range(p.n):
        me = middle * p.n + i
        bonds = patch[around[start[me] : start[me + 1]]] - patch[me]
        count[i] = len(bonds)
        psi[i] = np.mean(((bonds[:, 0] + 1j * bonds[:, 1]) / np.hypot(*bonds.T)) ** k)
    return psi, count


@pytest.mark.parametrize(("rows", "columns"), [(1, 1), (1, 2), (2, 3), (6, 5)])
def test_triangular_lattice(rows, columns):
    """Six neighbours, exp(6 i angle) = 1 on all of them, from one particle in the cell on."""
    order = hexatic_order(lattice(rows, columns, TRIANGULAR))
    assert order.neighbors.tolist() == [6] * (rows * columns)
    assert order.local == pytest.approx(np.ones(rows * columns), abs=1e-12)
    assert order.mean_local == pytest.approx(1) and order.global_order == pytest.approx(1)


@pytest.mark.parametrize("m", [3, 6, 8])
def test_square_lattice_has_diagonals_only_beyond_rounding(m):
    """Diagonals of a square are no bonds: four neighbours, psi_4 = 1.

    Noise far above rounding decides which diagonal is one, with wave -1: psi_4 = (8 - m)/m of four sides and m - 4
    diagonals, and the mean number of neighbours is 6.
    """
    p = lattice(m, m, np.eye(2))
    order = hexatic_order(p, 4)
    assert order.neighbors.tolist() == [4] * m**2 and order.local == pytest.approx(np.ones(m**2), abs=1e-12)
    noise = 1e-5 * np.random.default_rng(m).normal(size=(m * m, 2))
    order = hexatic_order(p.with_state(positions=p.positions + noise), 4)
    assert order.local == pytest.approx((8 - order.neighbors) / order.neighbors, abs=2e-4)
    assert order.neighbors.mean() == 6


@pytest.mark.parametrize("k", [4, 6])
@pytest.mark.parametrize("cell", [np.eye(2), np.diag([1.0, 1.7]), np.array([[1.0, 0.0], [1.0, 1.0]])], ids=str)
@pytest.mark.parametrize(("rows", "columns"), [(1, 1), (1, 2), (2, 1)])
def test_lattices_of_one_and_two_particles_do_not_change_with_rounding(rows, columns, cell, k):
    """Nor with where they lie, nor with the vectors of their box."""
    p = lattice(rows, columns, cell)
    expected = hexatic_order(p, k)
    rng = np.random.default_rng(0)
    for _ in range(5):
        moved = p.positions + rng.uniform(-5, 5, 2) + 1e-15 * rng.normal(size=(p.n, 2))
        box = p.box + np.outer([0, rng.integers(-3, 4)], p.box[0])
        order = hexatic_order(p.with_state(positions=moved, box=box), k)
        assert order.neighbors.tolist() == expected.neighbors.tolist()
        assert order.local == pytest.approx(expected.local, abs=1e-12)


@pytest.mark.parametrize("k", [2, 6])
@pytest.mark.parametrize(("n", "seed", "tilt"), [(5, 0, 0.0), (12, 1, -0.7), (60, 2, 0.3), (60, 3, 0.0)])
def test_against_a_patch_of_twenty_five_cells(n, seed, tilt, k):
    """Neighbours and psi of the cell in the middle."""
    p = random_points(n, seed, tilt)
    psi, count = own_order(p, k)
    order = hexatic_order(p, k)
    assert np.array_equal(order.neighbors, count)
    assert order.local == pytest.approx(psi, abs=1e-12)


def test_droplets_count_by_their_centroids(dp_dense):
    """As disks in the same places."""
    disks = packed(dp_dense.centroids, dp_dense.box)
    assert hexatic_order(dp_dense).local == pytest.approx(hexatic_order(disks).local, abs=1e-12)
    assert len(hexatic_order(dp_dense).local) == dp_dense.n


@pytest.mark.parametrize("k", [0, -6, 6.0, True, "6", None])
def test_bad_symmetry_is_refused(k):
    with pytest.raises(jamlab.InputError, match=repr(k)):
        hexatic_order(random_points(), k)


@pytest.mark.parametrize("seed", range(4))
def test_circles_around_a_void_hold_no_copy_however_far_it_lies(seed):
    """Points in one corner of the box: circles are larger than the first search reaches."""
    rng = np.random.default_rng(seed)
    points, box = 0.15 * rng.random((30, 2)) @ np.diag([1.0, 4.0]), np.array([[1.0, 0.0], [0.3, 1.0]])
    p = packed(points, box)
    assert np.array_equal(hexatic_order(p).neighbors, own_order(p, 6, copies=9)[1])


def test_two_particles_in_one_place_are_refused():
    with pytest.raises(jamlab.InputError) as refused:
        hexatic_order(packed([[1.0, 1.0], [3.0, 2.0], [1.0, 1.0], [2.0, 3.0]], 5 * np.eye(2)))
    assert "particle 0 " in str(refused.value) or "particle 2 " in str(refused.value)
