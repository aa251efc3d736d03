"""A picture becomes a packing: as many droplets, their sizes, the packing fraction of the picture, at a minimum."""

import numpy as np
import pytest

import jamlab
from jamlab.errors import InputError

pytest.importorskip("skimage")


@pytest.fixture(scope="module")
def seen(dp_dense):
    return jamlab.micrograph(jamlab.synthetic_micrograph(dp_dense, 240), periodic=True, contrast="bright")


@pytest.fixture(scope="module")
def disks(seen):
    return seen.packing("sp")


def test_disks_keep_sizes_and_packing_fraction(seen, disks):
    assert disks.converged and jamlab.packing_fraction(disks) == pytest.approx(seen.rho, abs=2e-4)
    ratio = np.pi / 4 * disks.diameters**2 / seen.areas
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-9)


def test_droplets_come_back_as_the_packing_that_was_rendered(seen, dp_dense):
    droplets = seen.packing("dp")
    assert droplets.n == dp_dense.n and droplets.converged
    assert jamlab.packing_fraction(droplets) == pytest.approx(seen.rho, abs=2e-4)
    assert jamlab.contacts(droplets).z == pytest.approx(jamlab.contacts(dp_dense).z, abs=0.6)


def test_mirror_image_has_the_same_energy(disks, dp_dense):
    """The patch does not prefer a corner: a picture turned upside down gives the disks turned upside down."""
    picture = jamlab.synthetic_micrograph(dp_dense, 240)[::-1, ::-1]
    turned = jamlab.micrograph(picture, periodic=True, contrast="bright").packing("sp")
    assert jamlab.evaluate(turned).energy == pytest.approx(jamlab.evaluate(disks).energy, rel=0.05)


def test_refusals(seen):
    with pytest.raises(InputError, match="model"):
        seen.packing("foam")
    with pytest.raises(InputError, match="no parameter 'gamma'"):
        seen.packing("sp", gamma=0.2)
    y, x = np.mgrid[:60, :60]
    few = jamlab.micrograph(labels=(np.hypot(x % 30 - 15, y % 30 - 15) < 10).astype(int))
    with pytest.raises(InputError, match="4 droplets are whole"):
        few.packing()
