"""Meetings of vertices and edges in every contact form against plain loops over images."""

from functools import partial

import numpy as np
import pytest
from hypothesis import given
from outlines import feet
from packings_by_hand import SQUARE, droplets
from random_packings import polygons

import jamlab
from jamlab.errors import InputError
from jamlab.geometry.vertex_contacts import vertex_contacts
from jamlab.laws.rim import CONTACT_FORMS


def images_within(packing):
    """All translations that may bring one site of the packing beside another."""
    box, extent = packing.box, np.ptp(packing.positions, axis=0) + packing.params["delta"]
    up = int(np.ceil(extent[1] / box[1, 1]))
    across = int(np.ceil((extent[0] + up * abs(box[1, 0])) / box[0, 0]))
    return [(a, b) for a in range(-across, across + 1) for b in range(-up, up + 1)]


def loop(packing):
    """(vertex, tail, image of the edge) -> distance of all that are nearer than delta."""
    x, after, particle = packing.positions, packing.polygons.successor, packing.particle
    found = {}
    for image in images_within(packing):
        tail = x + np.array(image) @ packing.box
        for v in range(len(x)):
            distance = feet(x[v][None], tail, tail + packing.polygons.edges)[0][0]
            near = (distance < packing.params["delta"]) & ((particle != particle[v]) | any(image))
            found |= {(v, int(k), *image): distance[k] for k in np.flatnonzero(near)}
    return found, after


def closest(found, names):
    """The least distance of every name."""
    least = {}
    for key, distance in found.items():
        for name in names(*key):
            least[name] = min(distance, least.get(name, np.inf))
    return least


def named(packing, form):
    """What the form counts once -> its distance, from plain loops."""
    found, after = loop(packing)
    before = np.argsort(after)
    particle = packing.particle

    def edge_pairs(v, tail, *image):
        for own in (v, before[v]):
            mine, theirs = (int(own), tail, *image), (tail, int(own), -image[0], -image[1])
            yield min(mine, theirs)

    forms = {
        "segment/smooth": lambda v, tail, *image: [(v, tail, *image)],
        "outline": lambda v, tail, *image: [(v, int(particle[tail]), *image)],
        "segment": edge_pairs,
    }
    return closest(found, forms[form])


@given(polygons())
def test_meetings_are_those_of_a_loop(packing):
    form = packing.params["contact"]
    found, wanted = vertex_contacts(packing), named(packing, form)
    assert len(found.vertex) == len(wanted)
    np.testing.assert_allclose(np.sort(found.distance), np.sort(list(wanted.values())), atol=1e-14)
    image = np.rint(found.shift @ np.linalg.inv(packing.box)).astype(int)
    if form != "segment":
        other = found.tail if form == "segment/smooth" else packing.particle[found.tail]
        keys = list(zip(found.vertex.tolist(), other.tolist(), *image.T.tolist(), strict=True))
        assert keys == sorted(wanted)
        np.testing.assert_allclose(found.distance, [wanted[key] for key in keys], atol=1e-14)
    onto = packing.positions[found.tail] + found.shift + found.place[:, None] * packing.polygons.edges[found.tail]
    np.testing.assert_allclose(packing.positions[found.vertex] - onto, found.separation, atol=1e-13)


@pytest.mark.parametrize("form", CONTACT_FORMS)
@pytest.mark.parametrize(("box", "delta"), [
    ([[1.2, 0.0], [0.0, 1.3]], 0.32),  # meets its own images
    ([[1.2, 0.0], [7e4 * 1.2 + 0.1, 1.3]], 0.3),  # the same, in a box tilted beyond recognition
    ([[1.2, 0.0], [0.5, 1.3]], 0.9),  # and beyond the next ones
])  # fmt: skip
def test_one_droplet_in_a_box_hardly_larger(form, box, delta):
    reduced = np.array(box)
    reduced[1, 0] = np.mod(reduced[1, 0], reduced[0, 0])
    found = vertex_contacts(droplets([SQUARE + 40.3], delta, box, form))
    wanted = named(droplets([SQUARE], delta, reduced, form), form)
    np.testing.assert_allclose(np.sort(found.distance), np.sort(list(wanted.values())), atol=1e-9)


@pytest.mark.parametrize("form", CONTACT_FORMS)
def test_repeated_vertices_collinear_and_endless_edges(form):
    """A vertex twice, one in the middle of an edge, and an edge forty times as long as the others."""
    rough = np.insert(SQUARE, [1, 2], [[0.5, 0.0], [1.0, 0.0]], axis=0)
    long = np.array([[0.0, -1.0], [40.0, -1.0], [40.0, -0.1], [0.0, -0.1]])
    packing = droplets([rough + 0.05, np.add(rough, [2, 0.05]), long], 0.3, 80 * np.eye(2), form)
    found, wanted = vertex_contacts(packing), named(packing, form)
    np.testing.assert_allclose(np.sort(found.distance), np.sort(list(wanted.values())), atol=1e-14)


def test_what_touches_exactly_at_delta_does_not_meet():
    pair = [SQUARE, np.add(SQUARE, [1.25, 0.0])]
    for delta, meet in ((0.25, False), (np.nextafter(0.25, 1), True)):
        assert bool(len(vertex_contacts(droplets(pair, delta, contact="segment/smooth")).vertex)) == meet


def test_edges_over_too_many_images_are_refused():
    packing = droplets([SQUARE * [200.0, 1.0]], 0.1, 0.04 * np.eye(2), "segment/smooth")
    with pytest.raises(InputError, match="box"):
        vertex_contacts(packing)


def _rectangle(width, height, centre):
    return np.array([[-width, -height], [width, -height], [width, height], [-width, height]]) / 2 + centre


@pytest.mark.parametrize("contact", ["segment", "outline", "segment/smooth"])
@pytest.mark.parametrize("far", [0.0, 9.0, -18.0])
@pytest.mark.parametrize(
    "other", [_rectangle(1.0, 4.0, 4.0), _rectangle(0.4, 0.4, 4.0)], ids=["a plus sign", "one inside"]
)
def test_outlines_that_cross_far_from_vertices_are_refused(contact, far, other):
    """No vertex comes near an edge of the other; images are outlines too."""
    one = _rectangle(4.0, 1.0 if other[1, 1] > 5 else 2.0, 4.0)
    packing = droplets([one, other + far], 0.25, 9 * np.eye(2), contact, rest_area=4.0)
    energy = partial(jamlab.measure, quantities="energy")
    for look in (jamlab.contacts, jamlab.hessian, energy, jamlab.evaluate, partial(jamlab.shear, rate=0.1, strain=0.1)):
        with pytest.raises(jamlab.InputError, match=r"0\D+1"):
            look(packing)


def test_a_small_outline_inside_another_of_short_edges_is_refused():
    """No vertex of either comes near an edge of the other, and areas alone tell where one has room in the other."""
    turn = 2 * np.pi * np.arange(64) / 64
    ring = np.column_stack([np.cos(turn), np.sin(turn)])
    with pytest.raises(InputError):
        vertex_contacts(droplets([0.3 * ring + 5, 0.1 * ring[::4] + 5], 0.06, contact="segment/smooth"))
