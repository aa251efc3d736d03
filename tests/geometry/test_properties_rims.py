"""True packing fraction of random polygons with rims: by the boundary, by a union of outlines, by counting points."""

import numpy as np
import pytest
import random_packings
import shapely
from hypothesis import example, given

import jamlab

IMAGES = np.array([(a, b) for a in range(-3, 4) for b in range(-2, 3)])


def images(packing):
    """The polygons without rim, with all their copies around the cell that reach into it."""
    rings = [shapely.linearrings(ring) for ring in np.split(packing.positions, packing.offsets[1:-1])]
    outlines = shapely.polygons(rings)
    moved = [shapely.transform(outlines, lambda x, move=move: x + move) for move in IMAGES @ packing.box]
    copies = np.concatenate(moved)
    return copies[shapely.distance(copies, cell(packing)) < packing.params["delta"]]


def cell(packing):
    return shapely.Polygon([[0, 0], packing.box[0], packing.box.sum(axis=0), packing.box[1]])


def covered(packing, steps):
    """Area that outlines with their rims cover in the cell; shapely draws a quarter of an arc in so many steps."""
    grown = shapely.buffer(images(packing), 0.5 * packing.params["delta"], quad_segs=steps)
    return shapely.intersection(shapely.union_all(grown), cell(packing)).area


@given(random_packings.polygons())
def test_rho_is_the_area_of_the_union_of_outlines(packing):
    """Chords of arcs lose area as 1/steps^2: two drawings extrapolate, to a tenth of what they differ by."""
    coarse, fine = covered(packing, 8), covered(packing, 16)
    assert jamlab.packing_fraction(packing) * packing.area == pytest.approx(
        (4 * fine - coarse) / 3, abs=0.1 * (fine - coarse) + 1e-9
    )


def resting_on_its_own_image():
    """A triangle whose tip lies in the rim of its own image's base: an edge hides the neighbour of its own image."""
    corners = [[0.72, 0.85], [0.14, 0.3], [0.82, 0.39], [1.54, 0.92], [1.19, 0.26], [1.71, 0.27]]
    law = {"gamma": 1.0, "ka": 500.0, "eps": 1.0, "delta": 0.375, "eta": 0.0, "contact": "outline", "a0": [0.3, 1.0]}
    return jamlab.Packing("dp", [[2.0, 0.0], [0.0, 1.0]], corners, law, offsets=[0, 3, 6])


@example(resting_on_its_own_image())
@given(random_packings.polygons())
def test_rho_shared_among_particles_and_left_to_voids(packing):
    rho = jamlab.packing_fraction(packing)
    assert jamlab.exact_method(packing) == "boundary"
    assert jamlab.particle_areas(packing).sum() / packing.area == pytest.approx(rho, abs=3e-7)
    assert 1 - jamlab.voids(packing).area.sum() / packing.area == pytest.approx(rho, abs=1e-12)
