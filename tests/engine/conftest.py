"""A packing for the tests of decks, one LAMMPS for each test of the plugin."""

import pytest

import jamlab
from jamlab.engine.installation import start_lammps


@pytest.fixture(scope="session")
def dense():
    """A packing of disks in which every contact bears load: none opens or closes at small strain."""
    *_, packing = jamlab.compress(jamlab.jam(32, "sp", 2), 0.93, 0.05, by="phi")
    return packing


@pytest.fixture
def lmp(tmp_path, monkeypatch):
    """In the folder of the test; some errors leave it unusable."""
    monkeypatch.chdir(tmp_path)
    instance = start_lammps()
    yield instance
    instance.close()
