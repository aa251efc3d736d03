"""One LAMMPS for each test of the plugin."""

import pytest

from jamlab.engine.installation import lammps_class


@pytest.fixture
def lmp(tmp_path, monkeypatch):
    """In the folder of the test; some errors leave it unusable."""
    monkeypatch.chdir(tmp_path)
    instance = lammps_class()(cmdargs=["-screen", "none", "-log", "none", "-nocite"])
    yield instance
    instance.close()
