"""Observables of the campaigns: packing fractions of the paper, what particles share, counts of contacts."""

from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from packings_by_hand import HEXAGONAL, disks

import jamlab
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.models.droplets import regular_polygon
from jamlab.packing.packing import Packing
from studies.campaigns import observables
from studies.campaigns.observables import (
    add_triples,
    rho_printed,
    root_mean_squares,
    shared_fraction,
)


def droplets(positions, side):
    law = {"gamma": 0.05, "ka": 10.0, "eps": 1.0, "delta": 0.2, "eta": 0.0, "contact": "outline"}
    law["a0"] = np.ones(len(positions))
    vertices = np.concatenate([x + regular_polygon(12, 1.0) for x in np.asarray(positions)])
    return Packing("dp", np.diag([side, side]), vertices, law, offsets=12 * np.arange(len(positions) + 1))


TRIANGLE = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, np.sqrt(0.75)]])


def test_triples_add_the_reuleaux_triangle_once_and_the_paper_twice():
    packing = disks(TRIANGLE, [2.0, 2.0, 2.0], np.diag([5.0, 5.0]))
    pairs, reuleaux = packing_fraction(packing, "pairs"), (np.pi - np.sqrt(3)) / 2 / 25
    np.testing.assert_allclose(add_triples(packing), pairs + reuleaux, rtol=1e-13)
    np.testing.assert_allclose(rho_printed(packing), pairs + 2 * reuleaux, rtol=1e-13)
    np.testing.assert_allclose(packing_fraction(packing), pairs + reuleaux, rtol=1e-13)


def test_triples_of_images_in_a_small_cell():
    """A hexagonal crystal of one disk, compressed until its holes have closed: only triples meet, at every hole."""
    radius = 0.6
    packing = disks([[0.2, 0.1]], [2 * radius], HEXAGONAL)
    np.testing.assert_allclose(add_triples(packing), 1.0, rtol=1e-13)
    repeated = disks(np.array([[0, 0], [1, 0], [0, 1], [1, 1]]) @ HEXAGONAL, np.full(4, 2 * radius), 2 * HEXAGONAL)
    np.testing.assert_allclose(add_triples(repeated), 1.0, rtol=1e-13)


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.1, 0.2, 0.35]))
def test_triples_bound_rho_from_above(seed, scale):
    rng = np.random.default_rng(seed)
    box = np.array([[1.0, 0.0], [0.4, 1.0]])
    packing = disks(rng.random((12, 2)), scale * rng.uniform(0.5, 1.4, 12), box)
    exact, triples = packing_fraction(packing), add_triples(packing)
    assert exact <= triples + 1e-12
    assert packing_fraction(packing, "pairs") < exact - 1e-12 or triples == pytest.approx(exact, rel=1e-12)
    assert shared_fraction(packing) == pytest.approx(packing.phi - exact, abs=1e-12)


def test_what_two_droplets_share_is_the_area_common_to_their_outlines():
    """Drawn as polygons with round rims, without jamlab; a longer outline has more rim, which phi does not know."""
    packing = droplets([[1.5, 2.0], [2.75, 2.1]], 4.0)
    first, second = (shapely.Polygon(ring).buffer(0.1, quad_segs=256) for ring in packing.positions.reshape(2, 12, 2))
    shared = first.intersection(second).area / 16
    assert shared > 1e-4 and shared_fraction(packing) == pytest.approx(shared, rel=1e-4)
    stretched = packing.with_state(positions=packing.positions * [1.1, 1 / 1.1])
    own = packing.polygons.areas.sum() + 0.1 * stretched.polygons.perimeters.sum() + 2 * 0.01 * np.pi
    assert shared_fraction(stretched) == pytest.approx(own / 16 - packing_fraction(stretched), abs=1e-12)
    assert shared_fraction(stretched) > stretched.phi - packing_fraction(stretched)


def test_squares_of_approach_add_up_to_the_modulus():
    """Without pre-stress G_0 = k sum of squared approaches over the area, [T] eq 19; k is 1 here."""
    packing = jamlab.pack(32, 1e-2, 1)
    found = root_mean_squares(packing)
    static = jamlab.complex_modulus(packing, [1e-9], prestress=False).g0
    assert found["contact_density"] * found["rms_normal"] ** 2 == pytest.approx(static, rel=1e-9)
    assert found["rms_tangential"] > found["rms_normal"]


@pytest.mark.parametrize("name", ["reference", "beyond_the_papers", "dynamics"])
def test_campaigns_of_the_figures_are_valid(name):
    path = Path(observables.__file__).parent / f"{name}.toml"
    assert jamlab.open_campaign(path).content.name == name
