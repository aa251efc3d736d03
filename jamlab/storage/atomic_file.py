"""Files: endings by content, what the system says of a failure, and writing in one step.

Readers see the old file or the whole new one, never a part of it.
"""

import errno
import os
import re
import stat
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from jamlab.errors import InputError, StorageError

if TYPE_CHECKING:
    import pandas as pd


_ABANDONED = 86_400.0  # s since its last change after which a temporary file has no writer
_MODE = 0o666  # of new files, but for the umask
_NAME = re.compile(r"\.jamlab-(?P<node>.+)-(?P<process>\d+)-[0-9a-f]+\.tmp")
_looked_after: set[Path] = set()  # folders in which this process has removed what others left behind


def _node() -> str:
    return re.sub(r"\W", "_", os.uname().nodename)[:100]


def _remove_abandoned(folder: Path) -> None:
    """Remove the temporary files of writers of this machine that were killed: whose process is gone, and that nobody
    has changed for a day. Those of other machines stay: their writers may live, and their clocks be other ones."""
    with suppress(OSError):
        for file in folder.glob(".jamlab-*.tmp"):
            named = _NAME.fullmatch(file.name)
            if named is None or named["node"] != _node() or _runs(int(named["process"])):
                continue
            if time.time() - file.stat().st_mtime > _ABANDONED:
                file.unlink(missing_ok=True)


def _runs(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):  # it is another user's
        return True
    return True


@contextmanager
def atomic_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a temporary path `.jamlab-*.tmp` in the same folder, where a rename is atomic; it takes the place of `path`,
    or of the file that a link points to, when the block ends well, with the permissions of the old file. If the block
    raises, it is removed, and the old file stays as it was; what a killed process leaves behind, one that writes into
    the folder from the same machine a day later removes."""
    target = check_target(path)
    if target.parent not in _looked_after:
        _looked_after.add(target.parent)
        _remove_abandoned(target.parent)
    temporary = target.with_name(f".jamlab-{_node()}-{os.getpid()}-{os.urandom(8).hex()}.tmp")
    try:
        try:
            mode = stat.S_IMODE(target.stat().st_mode) if target.exists() else None
            os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, _MODE if mode is None else mode & _MODE))
            yield temporary
            if mode is not None:
                with suppress(PermissionError):  # some file systems have no permissions
                    temporary.chmod(mode)
            _flush(temporary)
            os.replace(temporary, target)
        except BaseException:
            with suppress(OSError):
                temporary.unlink()
            raise
    except StorageError:
        raise
    except OSError as error:
        said = system_said(error, f"check permissions and free space of {target.parent}")
        raise StorageError(f"cannot write {path}: {said}") from error
    with suppress(OSError):  # the file is in place; some file systems cannot flush a folder
        _flush(target.parent)


def make_folder(folder: Path) -> None:
    """Make a folder unless it is there, before the work whose results go into it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the name
        raise StorageError(f"cannot make the folder {folder}: {system_said(error, 'choose another')}") from error
    check_target(folder / "file")


def check_target(path: str | os.PathLike[str], *sources: str | os.PathLike[str], replace: bool = True) -> Path:
    """Refuse a path that cannot be written, or is one of the sources, before hours of work go into what should be
    written there; commands ask for `--force` to replace. Returns the file behind all links."""
    try:
        target = Path(os.path.realpath(path))
        mode = target.stat().st_mode if target.exists() else None
    except (OSError, ValueError) as error:  # too long, or a zero byte in it
        raise StorageError(f"cannot write {path}: {system_said(error, 'choose another')}") from error
    if mode is not None and stat.S_ISDIR(mode):
        raise StorageError(f"cannot write {path}: it is a folder; give the name of a file in it")
    if mode is not None and not stat.S_ISREG(mode):  # a rename would put a file in its place
        raise StorageError(f"cannot write {path}: it is a device, a pipe or a socket; give the name of a file")
    if any(target == Path(os.path.realpath(source)) for source in sources):
        raise StorageError(f"cannot write {path}: it is also the input; choose another name")
    if mode is not None and not replace:
        raise StorageError(f"{path} exists: choose another name, or give --force to replace it")
    if not target.parent.is_dir():
        raise StorageError(f"cannot write {path}: there is no folder {target.parent}; create it first")
    if not os.access(target.parent, os.W_OK):
        raise StorageError(f"cannot write {path}: the folder {target.parent} is write-protected; choose another")
    if mode is not None and not os.access(target, os.W_OK):
        raise StorageError(f"cannot write {path}: the file is write-protected; choose another name or `chmod u+w` it")
    return target


def check_targets(folder: Path, names: Iterable[str], *, replace: bool = False) -> None:
    """Refuse files of a folder, which may be missing, that cannot be written or may not be replaced, before any work.

    Raises:
        StorageError: see `check_target`.
    """
    for name in names if folder.is_dir() else ():
        check_target(folder / name, replace=replace)


def _flush(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


_FAILED = "the file system failed, not the file: try again, or ask who runs it"
_REMEDIES = {
    **dict.fromkeys((errno.EIO, errno.ESTALE, errno.ETIMEDOUT, errno.ENXIO, errno.ENODEV), _FAILED),
    **dict.fromkeys((errno.ENOLCK, errno.ENOTSUP), "this file system cannot do that: take a folder on another one"),
    errno.EDQUOT: "your quota is used up: remove files, or ask for more",
}
_OF_HDF5 = re.compile(r"errno = (\d+)")  # HDF5 gives the number in its text alone where h5py does not pass it on


def system_error(error: BaseException) -> int | None:
    """Number of the error of the system behind an error; None if there is none, so that the content is at fault."""
    found = error.errno if isinstance(error, OSError) else None
    number = found or next(map(int, _OF_HDF5.findall(str(error))), 0)
    return number or None


def system_said(error: BaseException, remedy: str) -> str:
    """Reason and remedy; `remedy`: where the reason itself suggests no other."""
    number = system_error(error)
    reason = os.strerror(number) if number is not None else error
    return f"{reason}; {_REMEDIES.get(number or 0, remedy)}"


FORMATS: dict[str, tuple[str, ...]] = {  # endings of what jamlab writes, the usual one first
    "packings": (".h5", ".hdf5", ".h5md"),
    "data": (".data", ".lmp", ".lammps"),
    "dump": (".dump", ".lammpstrj", ".lammpsdump"),
    "vtp": (".vtp",),
    "movie": (".mp4", ".gif"),
    "xyz": (".xyz", ".extxyz"),
    "page": (".html", ".htm"),
    "campaign": (".toml",),
    "picture": (".png", ".pdf", ".svg"),
    "png": (".png",),
    "table": (".csv",),
    "tabs": (".tsv",),
}
_ENDINGS = {ending for endings in FORMATS.values() for ending in endings}
_OF_LAMMPS = ("data", "dump")  # files that LAMMPS users name by what they begin with, as in data.droplets


def begins_as(path: str | os.PathLike[str]) -> str:
    """The kind of LAMMPS file that a name such as data.droplets begins with, or nothing."""
    start, _, rest = Path(os.fspath(path)).name.partition(".")
    return start if rest and start in _OF_LAMMPS else ""


def check_ending(path: str | os.PathLike[str], *kinds: str, option: str = "") -> None:
    """Refuse a name whose ending promises another format than these; names without an ending promise nothing.
    `kinds`: of `FORMATS`; `option`: of the command line that gave the name."""
    name = os.fspath(path)
    ending = Path(name).suffix.lower()
    allowed = [known for kind in kinds for known in FORMATS[kind]]
    if ending not in ("", *allowed) and not (begins_as(path) in kinds and ending not in _ENDINGS):
        raise InputError(f"{option} {name}: name a file that ends in {', '.join(allowed)}".lstrip())


def write_table(frame: "pd.DataFrame", path: Path) -> None:
    """Write a table without its index; numbers come back to the last bit."""
    check_ending(path, "table", "tabs")
    with atomic_file(path) as temporary:
        frame.to_csv(temporary, index=False, sep="\t" if path.suffix.lower() == ".tsv" else ",")
