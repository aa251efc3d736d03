"""A name promises a format by its ending, or by its beginning where LAMMPS does so."""

import pytest

from jamlab.errors import InputError
from jamlab.storage.formats import check_ending


def test_a_name_that_begins_as_lammps_does_may_not_end_as_another_format():
    """data.droplets is a data file; data.png would be taken for a picture by every other program."""
    check_ending("data.droplets", "data")
    for name in ("data.png", "data.h5", "dump.droplets"):
        with pytest.raises(InputError) as caught:
            check_ending(name, "data")
        assert name in str(caught.value)
