"""Length of the flats between deformable polygons, and what else is measured of outlines."""

import numpy as np
import pytest

import jamlab
from jamlab.packing.packing import Packing

BOX = np.diag([20.0, 20.0])


@pytest.fixture(scope="module")
def sp_dense():
    return jamlab.pack(16, 1e-2, seed=1)


def rectangle(width, height, corner, steps=4):
    """Counter-clockwise ring with `steps` edges on each side."""
    t = np.arange(steps)[:, None] / steps
    ends = np.array([[0, 0], [width, 0], [width, height], [0, height]], dtype=float)
    sides = [a + t * (b - a) for a, b in zip(ends, np.roll(ends, -1, axis=0), strict=True)]
    return np.concatenate(sides) + corner


def droplets(rings, delta=0.25, box=BOX, contact="outline"):
    law = {"gamma": 0.1, "ka": 1.0, "eps": 1.0, "delta": delta, "eta": 0.0, "contact": contact}
    law["a0"] = np.full(len(rings), 2.0)
    return Packing("dp", box, np.concatenate(rings), law, offsets=np.cumsum([0, *map(len, rings)]))


@pytest.mark.parametrize("gap", [0.05, 0.2])
def test_shifted_rectangles_share_their_common_side_and_what_lies_around_its_ends(gap):
    """Unit squares shifted by 0.4: 0.6 in common, sqrt(delta^2 - gap^2) past a corner, delta - gap round one."""
    packing = droplets([rectangle(1, 1, [1, 1]), rectangle(1, 1, [2 + gap, 1.4])])
    found = jamlab.contact_lengths(packing)
    assert found.pairs.tolist() == [[0, 1]]
    assert found.length == pytest.approx([0.6 + np.sqrt(0.25**2 - gap**2) + 0.25 - gap], rel=1e-3)  # arcs are polygons


def test_squares_beyond_delta_have_no_contact():
    packing = droplets([rectangle(1, 1, [1, 1]), rectangle(1, 1, [2.26, 1])])
    assert len(jamlab.contact_lengths(packing).length) == 0


def test_contact_across_the_boundary_and_with_two_images():
    """A bar that nearly spans the box touches the other from both sides: two contacts, seen however it is wrapped."""
    rings = [rectangle(2, 1, [1, 1]), rectangle(1.9, 1, [3.05, 1])]
    narrow = np.array([[4.0, 0.0], [1.0, 9.0]])
    moved = [rings[0], rings[1] + narrow[1] - 2 * narrow[0]]
    for shapes in (rings, moved):
        found = jamlab.contact_lengths(droplets(shapes, delta=0.12, box=narrow))
        assert found.pairs.tolist() == [[0, 1], [0, 1]]
        assert found.length == pytest.approx([1 + 2 * (0.12 - 0.05)] * 2, rel=1e-12)


def test_pairs_are_those_of_the_contact_network(dp_dense):
    found = jamlab.contact_lengths(dp_dense)
    assert {tuple(pair) for pair in found.pairs.tolist()} == {
        tuple(pair) for pair in jamlab.contacts(dp_dense).pairs.tolist()
    }
    assert np.all(found.length > 0) and np.all(found.length < dp_dense.perimeters.max() / 2)


def test_edges_and_areas_by_hand():
    packing = droplets([rectangle(1, 2, [1, 1]), rectangle(0.5, 1, [5, 5], steps=2)])
    assert jamlab.edge_lengths(packing).min() == pytest.approx(0.25)
    assert jamlab.edge_lengths(packing).sum() == pytest.approx(9.0)
    assert jamlab.area_ratios(packing) == pytest.approx([1.0, 0.25])


def test_area_ratio_of_half_a_disk_and_its_mean_is_rho_over_phi(sp_dense):
    """Two unit disks at distance 1 keep 2 pi/3 + sqrt(3)/4 of pi each."""
    pair = Packing("sp", BOX, [[0.0, 0.0], [1.0, 0.0]], {"eps": 1.0}, diameters=[2.0, 2.0])
    assert jamlab.area_ratios(pair) == pytest.approx([(2 * np.pi / 3 + np.sqrt(3) / 4) / np.pi] * 2)
    weights = sp_dense.diameters**2 / np.sum(sp_dense.diameters**2)
    assert jamlab.area_ratios(sp_dense) @ weights == pytest.approx(jamlab.packing_fraction(sp_dense) / sp_dense.phi)


def test_stress_from_centroids_is_that_of_all_terms(dp_dense):
    """At equilibrium (1/A) sum F_mn (R_m - R_n) over contacts equals the virial of contacts, tension and area."""
    from jamlab.geometry.vertex_contacts import vertex_contacts

    p = dp_dense
    found = vertex_contacts(p)
    m, n = p.particle[found.vertex], p.particle[found.tail]
    push = p.params["eps"] / p.params["delta"] * (1 - found.distance / p.params["delta"]) / found.distance
    force = push[:, None] * found.separation
    apart = p.centroids[m] - p.centroids[n] - found.shift
    by_centroids = np.einsum("ki,kj->ij", force, apart) / p.area
    whole = jamlab.evaluate(p).stress
    assert np.abs(by_centroids - whole).max() < 1e-8 * np.abs(whole).max()
