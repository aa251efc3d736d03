"""What calls of this machine tell while they run, for a process that did not start them.

The file has no name, so that nothing is left whatever ends its owner, and only processes of the same user reach it,
through `/proc`. Its head holds a secret, by which another machine or container finds that it is not the file of that
number here, and the end of what was added as a whole.
"""

import fcntl
import io
import os
import pickle
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple, Self

_SECRET, _END = 16, 8  # bytes of the head
_HEAD = _SECRET + _END


class Address(NamedTuple):
    """Where a letterbox is: process, number of its file, and secret."""

    process: int
    file: int
    secret: bytes


class Letterbox:
    """Takes letters of calls on this machine."""

    def __init__(self) -> None:
        self._file = tempfile.TemporaryFile(buffering=0)
        secret = os.urandom(_SECRET)
        self._file.write(secret + _HEAD.to_bytes(_END))
        self.address = Address(os.getpid(), self._file.fileno(), secret)

    def close(self) -> None:
        """Take no more letters."""
        self._file.close()

    def take(self) -> list[Any]:
        """Letters since the last look, in their order."""
        file = self._file.fileno()
        if os.fstat(file).st_size == _HEAD:
            return []
        with _held(file):
            content = os.pread(file, _end(file) - _HEAD, _HEAD)
            os.pwrite(file, _HEAD.to_bytes(_END), _SECRET)
            os.ftruncate(file, _HEAD)
        stream, letters = io.BytesIO(content), []
        while stream.tell() < len(content):
            letters.append(pickle.load(stream))
        return letters


class Sender:
    """Sends letters to a letterbox if it is of this machine."""

    def __init__(self, address: Address) -> None:
        self._address = address
        self._file: int | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        if self._file is not None and self._file >= 0:
            os.close(self._file)

    def send(self, letter: Any) -> bool:
        """Add a letter; returns whether there is such a letterbox here."""
        if self._file is None:
            self._file = self._open()
        if self._file < 0:
            return False
        with _held(self._file):
            begin = _end(self._file)
            written, content = 0, pickle.dumps(letter)
            while written < len(content):
                written += os.pwrite(self._file, content[written:], begin + written)
            os.pwrite(self._file, (begin + len(content)).to_bytes(_END), _SECRET)
        return True

    def _open(self) -> int:
        process, file, secret = self._address
        path = f"/proc/{process}/fd/{file}"
        try:
            if not os.path.isfile(path):
                return -1
            found = os.open(path, os.O_RDWR)
        except OSError:
            return -1
        if os.pread(found, _SECRET, 0) == secret:
            return found
        os.close(found)
        return -1


def _end(file: int) -> int:
    return int.from_bytes(os.pread(file, _END, _SECRET))


@contextmanager
def _held(file: int) -> Iterator[None]:
    """Keep other processes out; the lock of one that is killed is released."""
    fcntl.flock(file, fcntl.LOCK_EX)
    try:
        yield
    finally:
        fcntl.flock(file, fcntl.LOCK_UN)
