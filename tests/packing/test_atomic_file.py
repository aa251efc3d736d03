"""A file is written whole or not at all: failures keep the old file and leave no other behind."""

import os
import resource

import numpy as np
import pytest

from jamlab.errors import StorageError
from jamlab.packing.hdf5 import read, write
from jamlab.packing.packing import Packing


def disks(seed=0):
    positions = np.random.default_rng(seed).uniform(0, 3, (200, 2))
    return Packing("sp", 3 * np.eye(2), positions, {"eps": 1.0}, diameters=np.ones(200))


@pytest.mark.parametrize(
    ("place", "message"),
    [("absent/run.h5", "there is no folder"), (".", "it is a folder"), ("/proc/run.h5", "check permissions")],
)
def test_places_that_cannot_be_written(tmp_path, place, message):
    with pytest.raises(StorageError, match=f"cannot write .*{message}"):
        write(tmp_path / place, [disks()])
    assert os.listdir(tmp_path) == []


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_write_protection_is_kept(tmp_path):
    write(tmp_path / "run.h5", [disks()])
    (tmp_path / "run.h5").chmod(0o444)
    with pytest.raises(StorageError, match=r"run\.h5: the file is write-protected"):
        write(tmp_path / "run.h5", [disks(1)])
    (tmp_path / "locked").mkdir(mode=0o555)
    with pytest.raises(StorageError, match="Permission denied"):
        write(tmp_path / "locked" / "run.h5", [disks()])
    assert (read(tmp_path / "run.h5").positions == disks().positions).all()


def test_a_full_disk_keeps_the_old_file_and_leaves_no_other(tmp_path):
    write(tmp_path / "run.h5", [disks()])
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (5000, hard))  # a file that grows past this fails with EFBIG
    try:
        with pytest.raises(StorageError, match=r"cannot write .*run\.h5: File too large; check"):
            write(tmp_path / "run.h5", [disks(1), disks(2)])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert os.listdir(tmp_path) == ["run.h5"]
    assert (read(tmp_path / "run.h5").positions == disks().positions).all()


@pytest.mark.parametrize("failure", [KeyboardInterrupt(), OSError(5, "Input/output error")])
def test_an_interrupt_before_the_rename_keeps_the_old_file(tmp_path, monkeypatch, failure):
    write(tmp_path / "run.h5", [disks()])

    def stop(source, target):
        assert os.path.dirname(source) == str(tmp_path) and os.path.getsize(source) > 5000
        raise failure

    monkeypatch.setattr("jamlab.packing.atomic_file.os.replace", stop)
    with pytest.raises(KeyboardInterrupt if isinstance(failure, KeyboardInterrupt) else StorageError):
        write(tmp_path / "run.h5", [disks(1)])
    assert os.listdir(tmp_path) == ["run.h5"]
    assert (read(tmp_path / "run.h5").positions == disks().positions).all()


def test_a_link_stays_a_link_and_permissions_follow_the_umask(tmp_path):
    (tmp_path / "data").mkdir()
    (tmp_path / "run.h5").symlink_to(tmp_path / "data" / "real.h5")
    old = os.umask(0o027)
    try:
        write(tmp_path / "run.h5", [disks()])
    finally:
        os.umask(old)
    assert (tmp_path / "run.h5").is_symlink()
    assert (tmp_path / "data" / "real.h5").stat().st_mode & 0o777 == 0o640
    assert (read(tmp_path / "run.h5").positions == disks().positions).all()
