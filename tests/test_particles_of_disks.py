"""Particles of several disks: who is held, and what would be the answer of another model is refused."""

import numpy as np
import pytest
import twins

import jamlab
from jamlab.models.round_sites import RoundSites
from jamlab.protocols.moduli import _same_contacts


@pytest.fixture(scope="module", autouse=True)
def register():
    with twins.registered():
        yield


@pytest.fixture
def column():
    """Twins one above the other: each meets one above and one below, at two disks, and nothing beside it."""
    height = 0.9
    rows = np.array([[x, height * row] for row in range(4) for x in (0.0, 0.5)])
    params = {"eps": 1.0, "bond": 50.0, "aspect": 0.5}
    return jamlab.Packing("twin", np.diag([4.0, 4 * height]), rows + 0.2, params, "eps", np.ones(4))


def test_two_neighbours_hold_a_particle_that_meets_them_with_several_disks(column):
    found = jamlab.contacts(column)
    assert len(found.pairs) == 4 and not found.rattlers.any() and not found.unjammed
    assert found.z == found.z_all == 2.0


def test_two_contacts_of_disks_hold_no_particle(column):
    """In a row one disk of each twin meets one of the next."""
    row = np.array([[1.45 * k + x, 0.5] for k in range(4) for x in (0.0, 0.5)])
    found = jamlab.contacts(column.with_state(positions=row, box=np.diag([5.8, 4.0])))
    assert len(found.pairs) == 4 and found.rattlers.all() and found.unjammed


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (jamlab.rigid_clusters, "rigid clusters of twins"),
        (jamlab.nonaffine_response, "no single disks|unjammed|energy minimum"),
        (jamlab.droplets_from_disks, "no single disks"),
        (jamlab.contact_lengths, "no edges with rims"),
        (jamlab.synthetic_micrograph, "no outlines to picture"),
        (lambda p: jamlab.choose(0.9, {"z": 0.05}, model=p.model), "use one of auto, sp, dp"),
    ],
)
def test_what_is_of_other_models_is_refused_by_name(column, call, said):
    with pytest.raises(jamlab.JamlabError, match=said):
        call(column)


def test_a_dump_is_not_read_as_disks_where_the_model_is_not_known(column, tmp_path):
    jamlab.write(tmp_path / "t.dump", column)
    assert jamlab.read(tmp_path / "t.dump", model="twin") == column
    with pytest.raises(jamlab.InputError, match="particles of 2 atoms each are no disks"):
        jamlab.read(tmp_path / "t.dump", model="sp")


@pytest.mark.parametrize(
    ("method", "wrong", "said"),
    [
        ("free_area", lambda self, p: float(np.pi / 2 * np.sum(p.diameters**2)), "but the disks of these"),
        ("free_area", lambda self, p: None, "returns None"),
        ("shape", lambda self, d, p: np.zeros((len(d), 2)), r"\(4, 2\) for \(4, 2, 2\)"),
    ],
)
def test_an_area_or_shape_that_is_wrong_is_refused_before_anything_is_made(monkeypatch, method, wrong, said):
    monkeypatch.setattr(twins.Twins, method, wrong)
    with pytest.raises(jamlab.InputError, match=said):
        jamlab.jam(4, "twin")


def test_states_in_which_other_disks_of_two_neighbours_meet_are_told_apart(column):
    """As where the strain of a modulus is halved until no contact changes."""
    lower = column.positions.copy()
    lower[1, 1] -= 0.11  # it leaves the disk above it, and its particle remains a neighbour by the other disk
    parted = column.with_state(positions=lower)
    assert np.array_equal(jamlab.contacts(parted).pairs, jamlab.contacts(column).pairs)
    assert _same_contacts(column, column) and not _same_contacts(column, parted)


def test_bond_energies_that_are_no_arrays_of_bonds_are_refused(column):
    class Loose(RoundSites):
        name = "loose"

        def bond_energy(self, length, diameters, params):
            return 0.0, length, 1.0

    with pytest.raises(jamlab.InputError, match=r"model loose: `bond_energy` returns energies of shape \(\)"):
        Loose().shape_terms(column)
