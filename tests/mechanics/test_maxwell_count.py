"""What contacts hold: counts of disks, of polygons by hand, what no view of a packing may change."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from packings_by_hand import SQUARE, disks, droplets

import jamlab
from jamlab.errors import InputError
from jamlab.geometry.contact_network import count_strong
from jamlab.geometry.vertex_contacts import vertex_contacts
from jamlab.mechanics.force_network import without_load
from jamlab.mechanics.maxwell_count import COUNTING

STATES = Path(__file__).parents[1] / "protocols" / "states"


def squares(*rows, delta=0.1):
    """Squares of side 1 in a wide box: centre and angle of each."""
    places = []
    for x, y, angle in rows:
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        places.append((SQUARE - 0.5) @ turn + [x, y])
    return droplets(places, delta)


@pytest.mark.parametrize(("n", "seed"), [(16, 1), (16, 2), (32, 8)])
def test_disks_at_onset_have_one_state_of_self_stress_and_no_free_motion(n, seed):
    """Of (32, 8) rattlers touch others, which hold nothing."""
    packing = jamlab.jam(n, "sp", seed)
    found, network = jamlab.maxwell_count(packing), jamlab.contacts(packing)
    assert (found.contacts, found.pairs, found.n_particles) == (
        network.n_contacts,
        network.n_contacts,
        network.n_backbone,
    )
    assert (found.self_stress_states, found.floppy_modes) == (1, 0)


def test_squares_flat_on_flat_share_two_contacts():
    """Nothing holds a row from parting; of four around a point, which meet in five pairs, slides are left free."""
    row = squares((5, 5, 0.0), (6.05, 5.3, 0.0), (7.1, 5.1, 0.0))
    assert jamlab.maxwell_count(row) == jamlab.results.MaxwellCount(0, 0, 0, 0, 0)
    found = jamlab.maxwell_count(squares((5, 5, 0.0), (6.05, 5.3, 0.0), (6.05, 6.35, 0.0), (5, 6.05, 0.0)))
    assert (found.n_particles, found.pairs, found.contacts) == (4, 5, 10)
    assert (found.self_stress_states, found.floppy_modes) == (
        2,
        2,
    )  # aligned, they slide along x and y; none of them can turn


def test_a_corner_on_a_flat_is_one_contact_and_two_corners_as_well():
    """Three squares around a fourth: a corner on its left, corner to corner on its upper right, flat below."""
    tip = np.sqrt(0.5)
    near = 0.5 + tip * 0.5**0.5 + 0.05 * 0.5**0.5
    others = (5 - 0.5 - tip - 0.05, 5.0, np.pi / 4), (5 + near, 5 + near, 0.0), (5.2, 5 - 1.05, 0.0)
    packing = squares((5, 5, 0.0), *others)
    assert len(jamlab.contacts(packing).pairs) == 3
    rows = packing.kind.rigidity(packing)  # but for the fourth all are loose, so nothing is counted
    assert rows.shape == (1 + 1 + 2, 12)


def test_a_flat_that_leans_by_a_dent_holds_no_more_than_an_even_one():
    """By 1e-3 the couple that stops a square from turning is left to rounding of shapes; by 1e-2 it is not."""
    rest = (5, 5, 0.0), (6.05, 6.35, 0.0), (5, 6.05, 0.0)
    found = [jamlab.maxwell_count(squares(*rest, (6.05, 5.3, angle))) for angle in (0.0, 1e-3, 1e-2)]
    assert [each.floppy_modes for each in found] == [2, 2, 1]
    assert all(each.contacts - each.self_stress_states == 3 * 4 - 2 - each.floppy_modes for each in found)


def test_droplets_between_two_tips_bear_load_whether_by_their_corners_or_by_their_flats():
    """A column of squares and of diamonds that stand on their tips: only diamonds touch with a vertex.

    A diamond that leans on one of them from the side has nothing to bear against.
    """
    tip = np.sqrt(0.5)
    diamond = tip * np.array([[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]])
    height = 2 * (0.5 + tip + 0.05)
    corners = [(SQUARE - 0.5, 3.0, 1.0), (diamond, 3.1, 1 + 0.5 * height), (diamond, 3.0 + 0.5 + tip + 0.05, 1.0)]
    packing = droplets([shape + np.array(centre) for shape, *centre in corners], 0.1, np.diag([6.0, height]))
    network = jamlab.contacts(packing)
    assert network.rattlers.all() and set(packing.particle[vertex_contacts(packing).vertex]) == {1, 2}
    assert without_load(packing).tolist() == [False, False, True]


def rows_of_three(overlap, first=0.2, beside=0.2):
    """Squares flat on flat in their periodic cell, rows of three: each touches four, in its row by a fifth of delta.
    The third row, whose squares touch each other by `beside`, touches the others by a part `overlap` of delta, and
    those each other by `first`."""
    second, third = np.cumsum([1 + 0.1 * (1 - first), 1 + 0.1 * (1 - overlap)])
    rows = [[1.08 * x, y] for y in (0.0, second, third) for x in range(3)]
    sides = np.array([[1.0, 1.0]] * 6 + [[1.08 - 0.1 * (1 - beside), 1.0]] * 3)
    return droplets(
        [SQUARE * size + at for size, at in zip(sides, np.array(rows), strict=True)],
        0.1,
        np.diag([3.24, third + 1 + 0.1 * (1 - overlap)]),
    )


def test_contacts_below_the_threshold_hold_no_droplet_and_do_not_count():
    """Of 18 forces 12 are strong, so an overlap of 4e-5 of delta bears 3e-4 of their mean."""
    packing, held = rows_of_three(3.5e-5), np.repeat([True, True, False], 3)
    every, strong = (jamlab.contacts(packing, threshold=least) for least in (0.0, 3e-4))
    assert (every.n_contacts, every.z, every.z_all) == (18, 4, 4) and not every.rattlers.any()
    assert np.array_equal(strong.rattlers, ~held) and (strong.n_contacts, strong.z, strong.z_all) == (9, 3, 4)
    assert count_strong(packing) == {"z_strong": 3, "rattlers_strong": 3}
    assert jamlab.contacts(rows_of_three(4.5e-5), threshold=3e-4).n_contacts == 18
    chains = jamlab.contacts(rows_of_three(1e-5, first=1e-5), threshold=3e-4)  # rows alone press, but it is jammed
    assert chains.rattlers.all() and np.isnan(chains.z) and not chains.unjammed
    alike = replace(packing, params={**packing.params, "eps": 1e-6})  # whatever the unit of force
    assert np.array_equal(jamlab.contacts(alike, threshold=3e-4).rattlers, strong.rattlers)


def test_a_weak_contact_between_disks_that_others_hold_counts_by_default_alone():
    """Two rows of three: each disk touches two in its row and one in the other, and by 1e-6 an image of the latter."""
    packing = disks(np.array([[x, y] for y in (0.0, 0.9) for x in (0.0, 0.9, 1.8)]), 1.0, np.diag([2.7, 1.9 - 1e-6]))
    every, strong = (jamlab.contacts(packing, threshold=least) for least in (0.0, 1e-3))
    assert not every.rattlers.any() and not strong.rattlers.any()
    assert (every.z, strong.z, strong.z_all) == (4, 3, 4) and strong.forces.size[~strong.bearing].max() < 1.1e-6
    for bad in (-1e-9, 1.01, np.nan, "1e-3"):
        with pytest.raises(InputError):
            jamlab.contacts(packing, threshold=bad)


def test_a_droplet_between_two_opposite_contacts_is_held_though_it_rattles():
    packing = jamlab.read(STATES / "squeezed_droplet.h5")
    found = jamlab.maxwell_count(packing)
    assert found.n_particles == jamlab.contacts(packing).n_backbone + 1
    assert (found.self_stress_states, found.floppy_modes) == (2, 1)


def test_too_many_are_refused():
    rng = np.random.default_rng(0)
    n = COUNTING.most + 1
    many = jamlab.Packing("sp", 100 * np.eye(2), 100 * rng.random((n, 2)), {"eps": 1.0}, diameters=np.ones(n))
    with pytest.raises(InputError, match=f"{n}"):
        jamlab.maxwell_count(many)


# rigid clusters by the pebble game, against ranks of rigidity matrices of points at random places --------------------
