"""Check datasets of an HDF5 file before they are read: kind, shape, and that the file really holds so many numbers."""

from typing import Any

import h5py
import numpy as np

from jamlab.errors import StorageError

NUMBERS = "biuf"  # truth values, integers, unsigned integers, floating point
_REMEDY = "copy the file again, or run the task that wrote it again"
_DEFLATE = 1032  # zlib cannot compress further, and jamlab itself does not compress


def dataset(group: Any, name: str, kinds: str, shape: tuple[int | None, ...] | None = None) -> Any:
    """The dataset of a group, not read yet.

    Args:
        group: of an open file.
        name: of the dataset, a path from the group.
        kinds: codes of `numpy.dtype.kind` that are allowed; "T" stands for text.
        shape: wanted; None stands for any length, and for any shape.

    Raises:
        StorageError: it is missing, is not of these kinds or this shape, lies in another file, or is declared larger
            than what the file holds: reading it would fill the memory with nothing.
    """
    where = f"{group.file.filename} is damaged: {group.name.rstrip('/')}/{name}"
    found = group.get(name)
    if not isinstance(found, h5py.Dataset):
        raise StorageError(f"{where} {'is missing' if found is None else 'is not a dataset'}; {_REMEDY}")
    if found.file.id != group.file.id or found.external or found.is_virtual:
        raise StorageError(f"{where} lies in another file; {_REMEDY}")
    kind = "T" if h5py.check_string_dtype(found.dtype) else found.dtype.kind
    if kind not in kinds:
        raise StorageError(f"{where} holds values of type {found.dtype}; {_REMEDY}")
    if found.shape is None or (shape is not None and not _fits(found.shape, shape)):
        wanted = "" if shape is None else f", not ({', '.join('any' if s is None else str(s) for s in shape)})"
        raise StorageError(f"{where} has shape {found.shape}{wanted}; {_REMEDY}")
    size = int(np.prod([float(length) for length in found.shape])) * found.dtype.itemsize
    if size > _DEFLATE * found.id.get_storage_size():
        raise StorageError(f"{where} is declared with {size:.3g} bytes, which the file does not hold; {_REMEDY}")
    return found


def _fits(shape: tuple[int, ...], wanted: tuple[int | None, ...]) -> bool:
    return len(shape) == len(wanted) and all(w in (None, s) for s, w in zip(shape, wanted, strict=True))
