"""A file is written whole or not at all: failures keep the old file and leave no other behind."""

import contextlib
import fcntl
import os
import resource
import socket
import stat
import subprocess
import sys
import time

import numpy as np
import pytest
from commands import call

from jamlab.errors import StorageError
from jamlab.packing.hdf5 import read_hdf5
from jamlab.packing.packing import Packing
from jamlab.packing.write import write
from jamlab.storage.atomic_file import atomic_file, check_target


def disks(seed=0):
    positions = np.random.default_rng(seed).uniform(0, 3, (200, 2))
    return Packing("sp", 3 * np.eye(2), positions, {"eps": 1.0}, diameters=np.ones(200))


@pytest.mark.parametrize("place", ["absent/run.h5", ".", "/proc/run.h5", "a" * 300 + ".h5", "a\0b.h5"])
def test_places_that_cannot_be_written_or_read(tmp_path, place):
    for act in (lambda: write(tmp_path / place, [disks()]), lambda: read_hdf5(tmp_path / place)):
        with pytest.raises(StorageError):
            act()
    assert os.listdir(tmp_path) == []


def test_a_full_disk_keeps_the_old_file_and_leaves_no_other(tmp_path):
    write(tmp_path / "run.h5", [disks()])
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (5000, hard))  # a file that grows past this fails with EFBIG
    try:
        with pytest.raises(StorageError):
            write(tmp_path / "run.h5", [disks(1), disks(2)])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert os.listdir(tmp_path) == ["run.h5"]
    assert (read_hdf5(tmp_path / "run.h5").positions == disks().positions).all()


@pytest.mark.parametrize("failure", [KeyboardInterrupt(), OSError(5, "Input/output error")])
def test_an_interrupt_before_the_rename_keeps_the_old_file(tmp_path, monkeypatch, failure):
    write(tmp_path / "run.h5", [disks()])

    def stop(source, target):
        assert os.path.dirname(source) == str(tmp_path) and os.path.getsize(source) > 5000
        raise failure

    monkeypatch.setattr("jamlab.storage.atomic_file.os.replace", stop)
    with pytest.raises(KeyboardInterrupt if isinstance(failure, KeyboardInterrupt) else StorageError):
        write(tmp_path / "run.h5", [disks(1)])
    assert os.listdir(tmp_path) == ["run.h5"]
    assert (read_hdf5(tmp_path / "run.h5").positions == disks().positions).all()


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
    assert (read_hdf5(tmp_path / "run.h5").positions == disks().positions).all()


@pytest.fixture(params=["device", "pipe", "socket"])
def no_file(request, tmp_path):
    """A path to something that is neither a file nor a folder."""
    path = tmp_path / "run.h5"
    if request.param == "device":
        try:
            os.mknod(path, 0o666 | stat.S_IFCHR, os.makedev(1, 7))  # /dev/full
        except PermissionError:
            pytest.skip("only root makes devices")
    elif request.param == "pipe":
        os.mkfifo(path)
    else:
        with socket.socket(socket.AF_UNIX) as made, contextlib.chdir(tmp_path):
            made.bind(path.name)
    return path


def test_what_is_no_file_is_neither_replaced_nor_read(no_file, tmp_path):
    """As root, `jamlab jam --out /dev/full` turned the device into an HDF5 file."""
    before = no_file.stat()
    with pytest.raises(StorageError):
        write(no_file, [disks()])
    with pytest.raises(StorageError):
        read_hdf5(no_file)
    done = call(tmp_path, "jam", "--n", 8, "--out", no_file)
    assert done.exit_code == 1 and "run.h5" in done.stderr
    assert os.listdir(tmp_path) == ["run.h5"]
    assert (no_file.stat().st_mode, no_file.stat().st_ino) == (before.st_mode, before.st_ino)


def test_content_is_flushed_before_it_takes_the_name(tmp_path, monkeypatch):
    """Else a crash of the machine may leave an empty file under the name."""
    calls, replace = [], os.replace
    monkeypatch.setattr(os, "fsync", lambda handle: calls.append("fsync"))
    monkeypatch.setattr(os, "replace", lambda *paths: (calls.append("replace"), replace(*paths)))
    write(tmp_path / "run.h5", [disks()])
    assert calls[:2] == ["fsync", "replace"]


def test_files_are_read_without_locks(tmp_path):
    """HDF5 locks what it opens, which fails where there are no locks, and where another holds one as here."""
    write(tmp_path / "run.h5", [disks()])
    with open(tmp_path / "run.h5") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        assert (read_hdf5(tmp_path / "run.h5").positions == disks().positions).all()


def test_a_file_that_is_replaced_keeps_its_permissions(tmp_path):
    for mode in (0o600, 0o664, 0o755):
        write(tmp_path / "run.h5", [disks()])
        (tmp_path / "run.h5").chmod(mode)
        with atomic_file(tmp_path / "run.h5") as temporary:
            assert temporary.stat().st_mode & 0o777 & ~mode == 0  # nor can others read it before
            temporary.write_bytes(b"new")
        assert (tmp_path / "run.h5").stat().st_mode & 0o777 == mode
        assert (tmp_path / "run.h5").read_bytes() == b"new"


def test_temporary_files_of_killed_writers_are_removed_after_a_day(tmp_path):
    """Of this machine alone: a writer on another one may live, and its clock be days away."""
    code = "import os, sys; from jamlab.storage.atomic_file import atomic_file\n"
    code += "with atomic_file(sys.argv[1]): os.kill(os.getpid(), 9)"
    assert subprocess.run([sys.executable, "-c", code, tmp_path / "a"], check=False).returncode == -9
    (half,) = os.listdir(tmp_path)
    assert half.startswith(".jamlab-") and half.endswith(".tmp")
    *_, node, process, _ = half.split("-")
    kept = {
        half.replace(f"-{node}-", "-another_node-"),
        half.replace(f"-{process}-", f"-{os.getpid()}-"),  # of a writer that runs
        half.replace(f"-{process}-", "-1-"),
        ".jamlab-0.tmp",
    }
    for name in kept:
        (tmp_path / name).write_text("half")
    for name in (*kept, half):
        os.utime(tmp_path / name, (time.time() - 90_000.0,) * 2)
    young = half.replace(".tmp", "0.tmp")
    (tmp_path / young).write_text("of a writer that was killed a moment ago")
    write(tmp_path / "run.h5", [disks()])
    assert set(os.listdir(tmp_path)) == {*kept, young, "run.h5"}


@pytest.mark.parametrize("protected", ["folder", "file"])
def test_what_is_write_protected_is_named_before_the_work(tmp_path, monkeypatch, protected):
    """Permissions as the system tells them: those who run tests may be allowed everything."""
    (tmp_path / "a.h5").write_text("old")
    closed = tmp_path if protected == "folder" else tmp_path / "a.h5"
    monkeypatch.setattr("os.access", lambda path, mode: path != closed)
    with pytest.raises(StorageError) as caught:
        check_target(tmp_path / "a.h5")
    assert f"the {protected}" in str(caught.value) and "write-protected" in str(caught.value)


def test_a_thread_that_is_writing_as_its_process_ends_leaves_no_file(tmp_path):
    """As a worker of Dask that closes; a fork of the process leaves the file of its parent alone."""
    program = (
        "import os, sys, threading, time\n"
        "from jamlab.storage.atomic_file import atomic_file\n"
        "begun = threading.Event()\n"
        "def write():\n"
        "    with atomic_file(sys.argv[1]):\n"
        "        begun.set()\n"
        "        time.sleep(60)\n"
        "threading.Thread(target=write, daemon=True).start()\n"
        "begun.wait()\n"
        "if os.fork() == 0: sys.exit()\n"
        "os.wait()\n"
        "print(len(os.listdir(os.path.dirname(sys.argv[1]))))\n"
    )
    line = [sys.executable, "-c", program, str(tmp_path / "file")]
    ended = subprocess.run(line, capture_output=True, text=True, check=True)
    assert ended.stdout == "1\n" and list(tmp_path.iterdir()) == []
