"""Fixtures of the tests of decks."""

import pytest

import jamlab


@pytest.fixture(scope="session")
def dense():
    """A packing of disks in which every contact bears load: none opens or closes at small strain."""
    *_, packing = jamlab.compress(jamlab.jam("sp", 32, 2), 0.93, 0.05, by="phi")
    return packing
