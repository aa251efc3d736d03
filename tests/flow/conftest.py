"""Packings that flow: small ones, for speed."""

import pytest

import jamlab


@pytest.fixture(scope="session")
def disks():
    """Sixteen disks well above onset."""
    return jamlab.pack(n=16, pressure=2e-2, seed=2)


@pytest.fixture(scope="session")
def backbone():
    """Disks without rattlers, of positive modulus: what the frequency domain describes."""
    packing = jamlab.pack(n=32, pressure=1e-2, seed=3)
    return packing.select(~jamlab.contacts(packing).rattlers)
