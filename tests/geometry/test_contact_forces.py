"""Forces and gaps of contacts, one for each pair of particles, beside the energy and the distances of outlines."""

import numpy as np
import shapely
from hypothesis import given
from random_packings import disks, packings, polygons

from jamlab.geometry.contact_network import contacts
from jamlab.mechanics.energy_terms import energy_terms
from jamlab.mechanics.stiffness import forces


@given(packings())
def test_forces_on_a_particle_add_up_to_the_gradient_of_its_contact_energy(packing):
    network = contacts(packing)
    found = network.forces
    total, wanted = np.zeros((2, packing.n, 2))
    np.add.at(total, network.pairs[:, 1], found.on_j)
    np.subtract.at(total, network.pairs[:, 0], found.on_j)
    bearing = [terms for terms in energy_terms(packing) if terms.name in ("spring", "contact")]
    np.add.at(wanted, packing.particle, forces(packing, bearing))
    np.testing.assert_allclose(total, wanted, rtol=1e-9, atol=1e-9 * (1 + np.abs(wanted).max()))


@given(polygons())
def test_gap_of_droplets_is_the_distance_of_their_outlines_less_delta(packing):
    network = contacts(packing)
    outlines, (i, j) = packing.outlines(), network.pairs.T
    images = [
        shapely.transform(outlines[k], lambda x, s=s: x + s @ packing.box)
        for k, s in zip(j, network.shift, strict=True)
    ]
    distance = shapely.distance(outlines[i], np.array(images, dtype=object))
    np.testing.assert_allclose(network.forces.gap, distance - packing.params["delta"], atol=1e-9)


@given(disks())
def test_disks_push_each_other_apart_in_proportion_to_their_overlap(packing):
    network = contacts(packing)
    found = network.forces
    assert (found.gap < 0).all()
    assert (np.einsum("ij,ij->i", found.on_j, network.r) >= 0).all()
    stiffness = packing.params.get("k") or packing.params["eps"] / packing.diameters[network.pairs].mean(axis=1) ** 2
    np.testing.assert_allclose(found.size, -stiffness * found.gap, rtol=1e-9)
