"""Droplets of a picture become a periodic packing: sizes, packing fraction, what came from a packing comes back."""

import numpy as np
import pytest

import jamlab
from jamlab.micrographs.packing_of_picture import packing_of_picture

pytest.importorskip("skimage")


@pytest.fixture(scope="module")
def seen(dp_dense):
    return jamlab.micrograph(np.tile(jamlab.synthetic_micrograph(dp_dense, 160), (2, 2)), contrast="bright")


@pytest.fixture(scope="module")
def disks_seen(seen):
    return seen.packing("sp")


def test_disks_keep_sizes_and_packing_fraction(seen, disks_seen):
    assert disks_seen.converged and jamlab.packing_fraction(disks_seen) == pytest.approx(seen.rho, abs=2e-4)
    ratio = np.pi / 4 * disks_seen.diameters**2 / seen.areas
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-9)


def test_droplets_come_back_as_the_packing_that_was_rendered(seen, dp_dense):
    droplets = seen.packing("dp")
    assert droplets.n == seen.count and droplets.converged
    assert jamlab.packing_fraction(droplets) == pytest.approx(seen.rho, abs=2e-4)
    assert jamlab.contacts(droplets).z == pytest.approx(jamlab.contacts(dp_dense).z, abs=0.6)


def test_mirror_image_has_the_same_energy(disks_seen, dp_dense):
    """The patch does not prefer a corner: a picture turned upside down gives the disks_seen turned upside down."""
    picture = np.tile(jamlab.synthetic_micrograph(dp_dense, 160), (2, 2))[::-1, ::-1]
    turned = jamlab.micrograph(picture, contrast="bright").packing("sp")
    assert jamlab.evaluate(turned).energy == pytest.approx(jamlab.evaluate(disks_seen).energy, rel=0.05)


def test_what_no_picture_can_be(seen):
    y, x = np.mgrid[:60, :60]
    few = jamlab.micrograph(labels=(np.hypot(x % 30 - 15, y % 30 - 15) < 10).astype(int))
    for call in (lambda: seen.packing("foam"), lambda: seen.packing("sp", law={"gamma": 0.2}), few.packing):
        with pytest.raises(jamlab.InputError):
            call()


def test_the_patch_has_the_aspect_of_droplets_with_their_diameters():
    """Three rows of eight touching disks are 8 by 3 diameters, not 7 by 2 as their centres."""
    y, x = np.divmod(np.arange(24.0), 8)
    patch = packing_of_picture(np.column_stack([x, y]), np.full(24, np.pi / 4), np.ones(24), 0.8, "sp")
    assert patch.box[0, 0] / patch.box[1, 1] == pytest.approx(8 / 3)
