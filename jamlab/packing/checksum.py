"""Checksum of an HDF5 file of jamlab: damage is found at the speed of reading, before HDF5 interprets a byte.

The file starts with an HDF5 user block of 512 bytes, which HDF5 skips: one line of text, "jamlab LABEL sha256 DIGEST",
padded with zeros. The digest is that of all bytes after the block; the label is "packings", or "task" and the name of a
task of a campaign. One rule covers names, shapes, types and numbers alike: any change to the file is noticed. Whoever
edits a file on purpose copies its groups with h5py into a new one, which then has no checksum.
"""

import hashlib
import os
import re
from dataclasses import dataclass

USER_BLOCK = 512  # bytes; HDF5 looks for its signature at 0, 512, 1024, ...
PACKINGS = "packings"
_HEADER = re.compile(rb"jamlab (packings|task [0-9a-f]{32}) sha256 ([0-9a-f]{64})\n\0*")


@dataclass(frozen=True)
class Checksum:
    """Header of a file, compared with its content.

    Attributes:
        label: "packings", or "task" and the name of the task.
        matches: whether the content is that of the digest.
    """

    label: str
    matches: bool


def add_checksum(image: bytes, label: str = PACKINGS) -> bytes:
    """Put the user block in front of the bytes of an HDF5 file."""
    header = f"jamlab {label} sha256 {hashlib.sha256(image).hexdigest()}\n".encode()
    return header.ljust(USER_BLOCK, b"\0") + image


def checksum(path: str | os.PathLike[str]) -> Checksum | None:
    """Read a file through and compare; None if it has no such header, e.g. because jamlab 0.1.0 wrote it.

    Raises:
        OSError: the file cannot be read.
    """
    with open(path, "rb") as file:
        header = _HEADER.fullmatch(file.read(USER_BLOCK))
        if header is None:
            return None
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    return Checksum(header[1].decode(), digest == header[2].decode())
