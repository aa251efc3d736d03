"""Droplets from disks: areas, no crossed outlines, continuity across the hand-over."""

import numpy as np
import pytest
from laws_of_others import Ramp

import jamlab
from jamlab.geometry.vertex_contacts import vertex_contacts
from jamlab.models.droplets import free_area
from jamlab.protocols.droplets_from_disks import inscribe


@pytest.fixture(scope="module")
def disks():
    *_, last = jamlab.compress(jamlab.jam(12, "sp", 1), 0.88, 0.02)
    return last


@pytest.fixture(scope="module")
def droplets(disks):
    return jamlab.droplets_from_disks(disks)


def test_free_droplets_have_the_area_of_their_disks(disks):
    p = inscribe(disks)
    grown = free_area(np.diff(p.offsets), p.params)
    ratio = grown / (np.pi / 4 * disks.diameters**2)
    assert ratio == pytest.approx(np.full(disks.n, ratio[0]), rel=1e-10)
    assert np.sqrt(p.params["a0"]).mean() == pytest.approx(1.0, abs=1e-9)
    assert p.phi == pytest.approx(disks.phi, rel=1e-10)
    assert p.box[0, 0] ** 2 / disks.box[0, 0] ** 2 == pytest.approx(ratio[0], rel=1e-10)


def test_inscribed_polygons_lie_inside_their_disks_and_touch_at_most(disks):
    p = inscribe(disks)
    scale = p.box[0, 0] / disks.box[0, 0]
    reach = np.hypot(*(p.positions - (scale * disks.positions)[p.particle]).T)
    assert (reach <= (0.5 * scale * disks.diameters)[p.particle] - 0.5 * p.params["delta"] + 1e-12).all()
    assert (vertex_contacts(p).distance >= p.params["delta"] * (1 - 1e-9)).all()
    assert (p.polygons.areas > 0).all()


def test_handover_is_continuous(disks, droplets):
    """rho to 1e-6, z and contacts nearly; the droplets are at a minimum in a box of the same shape."""
    assert jamlab.packing_fraction(droplets) == pytest.approx(jamlab.packing_fraction(disks), abs=1e-6)
    assert droplets.converged and jamlab.evaluate(droplets).max_force < 1e-10
    before, after = jamlab.contacts(disks), jamlab.contacts(droplets)
    note = droplets.provenance["handover"]
    assert note["z"] == after.z and note["z_disks"] == before.z and abs(after.z - before.z) <= 0.5
    shared = {tuple(p) for p in before.pairs.tolist()} & {tuple(p) for p in after.pairs.tolist()}
    assert note["contacts_kept"] >= 0.75 and note["continuous"] is True
    assert len(shared) >= 0.75 * max(len(before.pairs), len(after.pairs))
    assert droplets.phi_J == disks.phi_J and droplets.units == "eps"


def test_loose_disks_are_no_continuous_handover():
    """Without contacts z has no value, and the note says so instead of passing it over."""
    p = jamlab.Packing("sp", 4 * np.eye(2), [[1.0, 1.0], [3.0, 3.0]], {"eps": 1.0}, diameters=[1.0, 1.4])
    note = jamlab.droplets_from_disks(p).provenance["handover"]
    assert note["continuous"] is False and np.isnan(note["z"])


def test_number_of_vertices_and_units(sp_jammed):
    """Vertices go with the diameter; disks in units k are taken too."""
    p = inscribe(sp_jammed, nv_small=24, nv_large=34)
    sizes = np.diff(p.offsets)
    assert set(sizes) == {24, 34}
    assert (sizes == np.where(sp_jammed.diameters > 1, 34, 24)).all() and p.units == "eps"


def test_attraction_is_refused_and_an_exponent_that_is_lost_is_said():
    """Droplets repel by springs."""
    with pytest.raises(jamlab.InputError, match=r"sticky disks of stickiness 0\.05: droplets do not attract"):
        jamlab.droplets_from_disks(jamlab.pack(8, phi=0.8, seed=1, law={"stickiness": 0.05}))
    *_, hertz = jamlab.compress(jamlab.jam(8, seed=1, law={"exponent": 2.5}), to=0.86, step=0.02)
    with pytest.warns(jamlab.JamlabWarning, match=r"exponent = 2\.5"):
        assert jamlab.droplets_from_disks(hertz).model == "dp"


def test_the_law_of_another_package_is_lost_in_words():
    disks = jamlab.pack(8, 1e-2, law=Ramp.name)
    with pytest.warns(jamlab.JamlabWarning, match="law 'ramp' of the disks is not kept"):
        droplets = jamlab.droplets_from_disks(disks)
    assert jamlab.packing_fraction(droplets) == pytest.approx(jamlab.packing_fraction(disks), abs=1e-5)
