"""Files of other programs as named columns, of text or arrays: how far they are rounded, and what damage raises."""

from __future__ import annotations

import bz2
import gzip
import lzma
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from tokenize import TokenError
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array, Indices
from jamlab.errors import InputError, JamlabError, StorageError
from jamlab.storage.atomic_file import system_said
from jamlab.storage.verified_file import FilePath
from jamlab.trajectories.sites import SIZE_NAMES, Sites, check_flat

COMPRESSED: dict[str, Any] = {".gz": gzip.open, ".bz2": bz2.open, ".xz": lzma.open}  # ending -> how to open it
FULL_DIGITS = 15  # numbers of full precision rarely end in more than two zeros; LAMMPS writes 6 by default
_CHOSEN_DIGITS = 4  # sizes and boxes of no more are taken for numbers that somebody chose
_SAMPLE = 500  # numbers that are looked at
_SAME_SIZE = 1e-4  # relative difference of radius and half the diameter of one disk, if both are rounded
# what Python, numpy, h5py, gsd and the packers of text raise on damaged files, beside errors of the system
DAMAGE = (
    *(ValueError, LookupError, TypeError, AttributeError, ArithmeticError, MemoryError, RuntimeError, SystemError),
    *(EOFError, SyntaxError, TokenError, zlib.error, lzma.LZMAError),
)


@contextmanager
def text_of(path: FilePath) -> Iterator[Iterator[str]]:
    """Lines of a text file, which may be compressed; errors in reading them are those of `damage_named`."""
    how = COMPRESSED.get(Path(path).suffix.lower(), open)
    with damage_named(path), how(path, "rt", encoding="utf-8-sig") as file:
        yield iter(file)


@contextmanager
def damage_named(path: FilePath) -> Iterator[None]:
    """Turn whatever a damaged file leads to into a `StorageError` that names the file."""
    try:
        yield
    except JamlabError as error:
        raise type(error)(f"{path}: {error}") from error
    except OSError as error:
        raise StorageError(f"cannot read {path}: {system_said(error, 'check the name and its permissions')}") from error
    except DAMAGE as error:
        said = " ".join(str(error).split())
        raise StorageError(f"{path} is damaged or cut off ({said}): copy it or write it again") from error


def rounding(words: Sequence[str], values: Array, *, chosen: bool = False) -> float:
    """How far numbers may be off because they were written with few digits, seen from some words; 0 for the digits of
    float64. Sizes and boxes may be chosen by hand: 0.7 is meant, 0.583333 is rounded."""
    digits = max(len(word.lower().partition("e")[0].lstrip("+-0.").replace(".", "")) for word in words[:_SAMPLE])
    largest = float(np.abs(values).max())
    if digits >= FULL_DIGITS or not largest or (chosen and digits <= _CHOSEN_DIGITS):
        return 0.0
    return float(0.5 * 10.0 ** (np.floor(np.log10(largest)) + 1 - max(digits, 1)))


def rounding_of(kind: Any, values: Array) -> float:
    """How far numbers may be off that a file holds in a type of fewer digits than float64."""
    if kind.kind != "f" or kind.itemsize >= 8:
        return 0.0
    return float(0.5 * np.finfo(kind.newbyteorder("=")).eps * np.abs(values).max())


class Columns:
    """Columns of one frame by name, each the words of a text or an array."""

    def __init__(self, columns: Mapping[str, Any]) -> None:
        self._columns = columns

    @classmethod
    def of_rows(cls, rows: Sequence[Sequence[str]], names: Mapping[str, int], count: int) -> Columns:
        """Columns of rows of words, each `count` long; `names`: place of a column by its name."""
        wrong = next((k for k, row in enumerate(rows) if len(row) != count), None)
        if wrong is not None:
            raise ValueError(f"row {wrong} has {len(rows[wrong])} columns, {count} expected")
        return cls({name: [row[k] for row in rows] for name, k in names.items()})

    def __contains__(self, name: str) -> bool:
        return name in self._columns

    def __len__(self) -> int:
        return len(next(iter(self._columns.values())))

    def words(self, name: str) -> list[str]:
        """A column as text."""
        return [value if isinstance(value, str) else f"{value:.15g}" for value in self._columns[name]]

    def numbers(self, name: str) -> Array:
        """A column as float64, all finite."""
        column = self._columns[name]
        values = np.asarray(column if isinstance(column, np.ndarray) else list(map(float, column)), dtype=np.float64)
        if not np.isfinite(values).all():
            raise ValueError(f"{column[int(np.flatnonzero(~np.isfinite(values))[0])]} is no finite number")
        return values

    def whole(self, name: str) -> Indices:
        """A column as int64."""
        return np.array(list(map(int, self._columns[name])), dtype=np.int64)

    def points(self, *names: str) -> Array:
        """(n, k) columns side by side."""
        return np.column_stack([self.numbers(name) for name in names])

    def error(self, *names: str, chosen: bool = False) -> float:
        """How far numbers of these columns may be off for their digits."""
        values, first = self.points(*names), self._columns[names[0]]
        if isinstance(first, np.ndarray):
            return rounding_of(first.dtype, values)
        words = zip(*(self._columns[name][:_SAMPLE] for name in names), strict=True)
        return rounding([word for row in words for word in row], values, chosen=chosen)

    def taken(self, rows: Indices | NDArray[np.bool_]) -> Columns:
        """The same of some rows, by mask or by number."""
        kept = np.arange(len(self))[rows]
        return Columns(
            {
                name: values[kept] if isinstance(values, np.ndarray) else [values[k] for k in kept]
                for name, values in self._columns.items()
            }
        )

    def by_id(self) -> Columns:
        """The same in the order of the column id."""
        ids = self.whole("id")
        if len(np.unique(ids)) != len(ids):
            raise ValueError("two atoms of a frame have the same id")
        return self.taken(np.argsort(ids))

    def types(self) -> NDArray[np.str_]:
        """(n,) names of types; "1" where none are given."""
        kind = next((name for name in ("type", "species", "element") if name in self), None)
        return np.array(["1"] * len(self) if kind is None else self.words(kind))

    def radius(self) -> tuple[Array | None, float]:
        """(n,) radii, None without, and how far they may be off; several columns must say the same."""
        found = {name: factor * self.numbers(name) for name, factor in SIZE_NAMES.items() if name in self}
        error = sum(SIZE_NAMES[name] * self.error(name, chosen=True) for name in found)
        first = next(iter(found), "")
        for other in [*found][1:]:
            wrong = np.flatnonzero(np.abs(found[other] - found[first]) > _SAME_SIZE * np.abs(found[first]))
            if len(wrong):
                said = " and ".join(f"{name} {self.numbers(name)[wrong[0]]:g}" for name in (first, other))
                raise InputError(f"disk {wrong[0]} has {said}: give one of them")
        return found.get(first), error

    def disks(self, box: Array | None, rounding: float = 0.0, **more: Any) -> Sites:
        """Disks at x and y in a box.

        Args:
            rounding: of what else the file says.
            more: fields of `Sites`.
        """
        places = self.points("x", "y")
        if "z" in self:
            check_flat(self.numbers("z"), float(np.ptp(places) if box is None else box[0, 0]))
        radius, error = self.radius()
        rounding += self.error("x", "y") + error
        return Sites(box, places, self.types(), radius=radius, rounding=rounding, **more)
