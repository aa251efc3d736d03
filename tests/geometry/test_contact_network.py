"""Contacts, their vectors and forces, and rattlers, against plain loops, the energy and distances of outlines."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from random_packings import packings, polygons

import jamlab
from jamlab.geometry.contact_network import (
    contacts,
    contacts_are_certain,
    find_rattlers,
    remove_rattlers,
)
from jamlab.geometry.power_cells import disk_cells
from jamlab.geometry.rims import rims
from jamlab.geometry.vertex_contacts import touching_disks
from jamlab.geometry.voids.boundary_loops import trace_polygons
from jamlab.mechanics.force_network import force_network
from jamlab.mechanics.stiffness import energy_terms, forces_of


@pytest.mark.parametrize("tilt", [0.0, 0.4])
def test_disks_that_touch_are_those_of_a_loop(random_disks, touching, tilt):
    packing = random_disks(tilt)
    found = touching_disks(packing)
    wanted = sorted((j, i, *(-r)) for i, j, r in touching(packing))
    rows = sorted(zip(found.i.tolist(), found.j.tolist(), *found.r.T.tolist(), strict=True))
    assert len(rows) == len(wanted) > packing.n
    np.testing.assert_allclose(rows, wanted, atol=1e-12)


def test_droplets_are_no_disks(dp_onset):
    for function in (touching_disks, disk_cells, jamlab.nonaffine_response):
        with pytest.raises(jamlab.InputError):
            function(dp_onset)


@pytest.mark.parametrize("function", [jamlab.contact_lengths, rims, trace_polygons])
def test_disks_have_no_outlines(sp_jammed, function):
    with pytest.raises(jamlab.InputError):
        function(sp_jammed)


@pytest.mark.parametrize("make", ["disks", "polygons", "spanning"])
def test_vectors_lead_to_the_image_that_is_touched(make, random_disks, random_polygons, spanning):
    kinds = {"disks": random_disks, "polygons": random_polygons, "spanning": lambda tilt: spanning("outline", tilt)}
    packing = kinds[make](0.3)
    network = jamlab.contacts(packing)
    i, j = network.pairs.T
    wanted = packing.centroids[j] + network.shift @ packing.box - packing.centroids[i]
    np.testing.assert_allclose(network.r, wanted, atol=1e-14)
    if make != "disks":  # the nearest outlines of the two are a contact apart
        for a, b, r in zip(i, j, network.r, strict=True):
            x, y = (packing.positions[packing.particle == m] - packing.centroids[m] for m in (a, b))
            apart = np.hypot(*(y[None] + r - x[:, None]).transpose(2, 0, 1)).min()
            assert apart < packing.params["delta"] + np.hypot(*packing.polygons.edges.T).max()


def test_rattlers_are_pruned_one_after_the_other():
    """A tetrahedron of contacts bears; a chain that hangs on it comes off, but for a particle that counts as held."""
    pairs = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3], [3, 4], [4, 5], [4, 6]])
    rattlers, bearing = find_rattlers(pairs, np.ones(7, dtype=bool))
    assert np.flatnonzero(rattlers).tolist() == [4, 5, 6] and np.flatnonzero(bearing).tolist() == list(range(6))
    held = np.ones(7, dtype=bool)
    held[[5, 6]] = False
    rattlers, bearing = find_rattlers(pairs, held)
    assert not rattlers.any() and bearing.all()


def test_contacts_below_a_part_of_the_mean_force_do_not_count(sp_jammed):
    network = jamlab.contacts(sp_jammed, threshold=0.3)
    strong = network.forces.size >= 0.3 * network.forces.size.mean()
    rattlers, bearing = find_rattlers(network.pairs[strong], np.ones(sp_jammed.n, dtype=bool))
    held = ~rattlers[network.pairs].any(axis=1)
    assert (network.rattlers == rattlers).all() and (held & ~strong).any()
    np.testing.assert_array_equal(np.flatnonzero(network.bearing), np.flatnonzero(strong)[bearing])


@pytest.mark.parametrize("name", ["sp_jammed", "dp_onset", "dp_dense"])
def test_network_renumbers_what_a_new_search_finds(request, name):
    """Contacts of the particles that bear load, bit for bit: Newton steps depend on the order of sums."""
    packing = request.getfixturevalue(name)
    network = force_network(packing)
    alone = packing.select(np.isin(np.arange(packing.n), packing.particle[network.held]))
    kept, fresh = (packing.kind.points(each) for each in (network.packing, alone))
    for field, values in vars(kept).items():
        np.testing.assert_array_equal(values, getattr(fresh, field), err_msg=field)
    for one, two in zip(energy_terms(network.packing), energy_terms(alone), strict=True):
        np.testing.assert_array_equal(one.hessian, two.hessian)
    np.testing.assert_array_equal(packing.positions[network.held], network.packing.positions)


@pytest.mark.parametrize("gap, certain", [(1.1, False), (2.8, False), (3.1, True), (-1.1, False), (-2.8, False)])
def test_a_contact_is_uncertain_while_rounding_may_open_or_close_it(gap, certain):
    """Both coordinates of both disks may be off, along the diagonal by 2 sqrt(2) times as much."""
    rounding = 1e-6
    apart = (1.0 + gap * rounding) / np.sqrt(2)
    p = jamlab.Packing("sp", 3 * np.eye(2), [[0.5, 0.5], [0.5 + apart, 0.5 + apart]], {"k": 1.0}, "k", np.ones(2))
    p = p.with_state(rounding=rounding)
    assert contacts_are_certain(p) == certain
    assert np.isnan(jamlab.measure(p, ["rattlers"])["rattlers"]) != certain


def test_a_packing_of_rattlers_leaves_nothing_without_them(random_disks):
    with pytest.raises(jamlab.InputError):
        remove_rattlers(random_disks(phi=0.01))


def test_the_onset_of_a_packing_is_not_that_of_its_backbone(random_disks):
    """phi of fewer particles is lower, so that phi - phi_J would be too."""
    p = random_disks(n=3).with_state(phi_J=0.84)
    assert p.select([True, False, True]).phi_J is None and p.select([True] * 3).phi_J == 0.84


@given(packings())
def test_forces_on_a_particle_add_up_to_the_gradient_of_its_contact_energy(packing):
    network = contacts(packing)
    found = network.forces
    total, wanted = np.zeros((2, packing.n, 2))
    np.add.at(total, network.pairs[:, 1], found.on_j)
    np.subtract.at(total, network.pairs[:, 0], found.on_j)
    bearing = [terms for terms in energy_terms(packing) if terms.name in ("spring", "contact")]
    np.add.at(wanted, packing.particle, forces_of(bearing, len(packing.positions)))
    np.testing.assert_allclose(total, wanted, rtol=1e-9, atol=1e-9 * (1 + np.abs(wanted).max()))


@given(polygons())
def test_gap_of_droplets_is_the_distance_of_their_outlines_less_delta(packing):
    network = contacts(packing)
    outlines, (i, j) = packing.polygons.shapes(), network.pairs.T
    images = [
        shapely.transform(outlines[k], lambda x, s=s: x + s @ packing.box)
        for k, s in zip(j, network.shift, strict=True)
    ]
    distance = shapely.distance(outlines[i], np.array(images, dtype=object))
    np.testing.assert_allclose(network.forces.gap, distance - packing.params["delta"], atol=1e-9)
