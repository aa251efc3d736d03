"""Files that are written in one step.

Readers see the old file or the whole new one, never a part of it.
"""

import atexit
import os
import re
import stat
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from jamlab.errors import StorageError, typed
from jamlab.storage.system_errors import system_said

_MODE = 0o666  # of new files, but for the umask
_under_way: set[Path] = set()  # temporary files of this process
_looked_after: set[Path] = set()  # folders in which this process has removed what others left behind


def _node() -> str:
    return _as_word(os.uname().nodename)


def _as_word(node: str) -> str:
    return re.sub(r"\W", "_", node)[:100]


def _remove_abandoned(folder: Path) -> None:
    """Remove the temporary files of writers of this machine that were killed: whose process is gone, and that nobody
    has changed for a day. Those of other machines stay: their writers may live, and their clocks be other ones."""
    with suppress(OSError):
        for file in folder.glob(".jamlab-*.tmp"):
            named = re.fullmatch(r"\.jamlab-(?P<node>.+)-(?P<process>\d+)-[0-9a-f]+\.tmp", file.name)
            if named is None or named["node"] != _node() or _runs(int(named["process"])):
                continue
            # s since its last change after which a temporary file has no writer
            if time.time() - file.stat().st_mtime > 86_400.0:
                file.unlink(missing_ok=True)


@atexit.register
def remove_own_temporaries() -> None:
    """Remove what this process is writing, as it ends: a thread in which a library calls may end in the middle."""
    own = f".jamlab-{_node()}-{os.getpid()}-"  # a fork knows those of its parent
    for temporary in [each for each in _under_way if each.name.startswith(own)]:
        with suppress(OSError):
            temporary.unlink()


def remove_temporaries(folder: Path, node: str, process: int) -> None:
    """Remove what a writer has left in a folder that was killed; `node`: name of its machine."""
    with suppress(OSError):
        for file in folder.glob(f".jamlab-{_as_word(node)}-{process}-*.tmp"):
            file.unlink(missing_ok=True)


def is_gone(node: str, process: int) -> bool:
    """Whether it is known that a process of a machine has ended."""
    return is_here(node) and not _runs(process)


def is_here(node: str) -> bool:
    """Whether a machine of this name is this one."""
    return _as_word(node) == _node()


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
    _under_way.add(temporary)
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
    finally:
        _under_way.discard(temporary)
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
    written there; commands ask for `--overwrite` to replace. Returns the file behind all links."""
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
        again = typed("overwrite=True", "--overwrite")
        raise StorageError(f"{path} exists: choose another name, or give {again} to replace it")
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
