"""Edit a file of jamlab with h5py and give it the checksum of its new content: what a hostile writer would do."""

from contextlib import contextmanager

import h5py

from jamlab.storage.verified_file import USER_BLOCK, add_checksum


@contextmanager
def edited(path):
    """The h5py.File, open for changes."""
    with h5py.File(path, "r+") as file:
        yield file
    path.write_bytes(add_checksum(path.read_bytes()[USER_BLOCK:]))
