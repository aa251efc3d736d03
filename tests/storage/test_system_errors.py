"""What the system says of a failure stands in the message, with the remedy that belongs to it."""

import errno
import os

import numpy as np
import pytest

from jamlab.errors import StorageError
from jamlab.packing.hdf5 import read_hdf5
from jamlab.packing.packing import Packing
from jamlab.packing.write import write
from jamlab.storage.system_errors import system_said


@pytest.mark.parametrize("number", [errno.EIO, errno.ESTALE, errno.ENOLCK, errno.EDQUOT, errno.EACCES])
@pytest.mark.parametrize("place", ["h5py.File", "h5py.is_hdf5", "builtins.open"])
def test_what_the_system_says_is_not_damage(tmp_path, monkeypatch, number, place):
    disk = Packing("sp", np.eye(2), np.zeros((1, 2)), {"eps": 1.0}, diameters=np.ones(1))
    write(tmp_path / "run.h5", disk)

    def fail(*_, **__):
        raise OSError(number, f"file read failed: errno = {number}, total read size = 8")

    monkeypatch.setattr(place, fail)
    with pytest.raises(StorageError) as caught:
        read_hdf5(tmp_path / "run.h5")
    monkeypatch.undo()
    assert os.strerror(number) in str(caught.value) and "damaged" not in str(caught.value)


@pytest.mark.parametrize(
    ("number", "remedy"), [(errno.EDQUOT, "quota"), (errno.EIO, "try again"), (errno.ENOLCK, "folder on another one")]
)
def test_the_remedy_is_of_the_reason(number, remedy):
    """What the caller proposes stands only where the system itself is not at fault."""
    assert remedy in system_said(OSError(number, os.strerror(number)), "choose another name")
    assert "choose another name" in system_said(OSError(errno.EACCES, "Permission denied"), "choose another name")
