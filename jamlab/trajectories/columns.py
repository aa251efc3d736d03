"""Files of other programs as named columns, of text or arrays: how far they are rounded, and what is damage."""

from __future__ import annotations

import bz2
import gzip
import lzma
import re
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tokenize import TokenError
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array, Indices
from jamlab.errors import InputError, JamlabError, StorageError, warn
from jamlab.packing.facts import rounding_of
from jamlab.storage.system_errors import system_error, system_said
from jamlab.storage.verified_file import FilePath
from jamlab.trajectories.sites import SIZE_NAMES, Sites, check_flat
from jamlab.type_variables import T

COMPRESSED: dict[str, Any] = {".gz": gzip.open, ".bz2": bz2.open, ".xz": lzma.open}  # ending -> how to open it


@dataclass(frozen=True)
class Digits:
    """What digits of columns say of how they were written."""

    full: int = 15  # numbers of full precision rarely end in more than two zeros; LAMMPS writes 6 by default
    chosen: int = 4  # sizes and boxes of no more are taken for numbers that somebody chose
    sample: int = 500  # numbers that are looked at
    same_size: float = 1e-4  # relative difference of radius and half the diameter of one disk, if both are rounded
    few_rows: int = 100  # whose last numbers are compared with that of a last row that has no end
    many: int = 6  # of numbers that a program wrote


DIGITS = Digits()

DISK_AREA = "area of the disk"  # column of a table, from which the radius follows where there is no other size
_FORTRAN = re.compile(r"(?<=[\d.])[dD](?=[+-]?\d+$)")  # 1.0D+00
# what Python, numpy, h5py, gsd and the packers of text raise on files that are not what they should be, beside errors
# of the system
_NOT_UNDERSTOOD = (
    *(ValueError, LookupError, TypeError, AttributeError, ArithmeticError, MemoryError, RuntimeError, SystemError),
    *(SyntaxError, TokenError),
)


class DamageError(ValueError):
    """A word that should be a number."""


class CutOffError(DamageError):
    """An end that comes too early."""


_DAMAGE = (DamageError, EOFError, zlib.error, lzma.LZMAError)


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
    except (OSError, *_DAMAGE) as error:  # packers of text raise an OSError for a checksum
        if system_error(error) is not None:
            said = system_said(error, "check the name and its permissions")
            raise StorageError(f"cannot read {path}: {said}") from error
        raise StorageError(f"{path} is damaged or cut off ({_said(error)}): copy it or write it again") from error
    except UnicodeDecodeError as error:
        raise StorageError(f"{path} is no text ({_said(error)}): check that its ending tells its format") from error
    except _NOT_UNDERSTOOD as error:
        raise StorageError(
            f"{path} is not understood ({_said(error)}): correct it, or see jamlab.read for what is read"
        ) from error


def _said(error: BaseException) -> str:
    return " ".join(str(error).split())


def whole_frames(path: FilePath, frames: Iterator[T]) -> Iterator[T]:
    """The frames of a file that may end within one, as where a job was killed: then those before, and a warning; the
    error if there are none."""
    count = 0
    try:
        for frame in frames:
            yield frame
            count += 1
    except (CutOffError, EOFError) as error:
        if not count:
            raise
        last = f"s 0 to {count - 1} are" if count > 1 else " 0 is"
        warn(f"{path} ends within frame {count} ({_said(error)}): frame{last} read")


def check_last_row(rows: Sequence[Sequence[str]], width: int, ended: bool, own: bool = False) -> None:
    """Refuse rows of a file that was cut off within the last one: it has fewer words than `width`, or its last number
    fewer digits than those above. `ended`: whether its line has an end, as programs write it. `own`: whether jamlab
    wrote the file, whose lines all have an end."""
    last, above = rows[-1], [row[-1] for row in rows[-DIGITS.few_rows : -1] if row]
    lost = bool(above) and bool(last) and len(last[-1]) < min(map(len, above)) >= DIGITS.many
    if not ended and (own or len(last) < width or lost):
        raise CutOffError(f"its last row is {' '.join(last)!r:.60}; if that is all of it, end it with a new line")


def number(word: str) -> float:
    """A number as Python or Fortran writes it."""
    try:
        return float(word)
    except ValueError:
        pass
    try:
        return float(_FORTRAN.sub("e", word))
    except ValueError:
        raise DamageError(f"{word!r:.40} is no number") from None


def rounding(words: Sequence[str], values: Array, *, chosen: bool = False, stated: bool = False) -> float:
    """How far numbers may be off because they were written with few digits, seen from some words; 0 for the digits of
    float64. Sizes and boxes may be chosen by hand: 0.7 is meant, 0.583333 is rounded. `stated`: the source says itself
    how far its numbers are off, which holds if all of them are as jamlab writes numbers, so that 0.5 is exact."""
    sample = words[: DIGITS.sample]
    if stated and all(word == f"{number(word):.17g}" for word in sample):
        return 0.0
    digits = max(len(re.split("[ed]", word.lower())[0].lstrip("+-0.").replace(".", "")) for word in sample)
    largest = float(np.abs(values).max())
    if digits >= DIGITS.full or not largest or (chosen and digits <= DIGITS.chosen):
        return 0.0
    return float(0.5 * 10.0 ** (np.floor(np.log10(largest)) + 1 - max(digits, 1)))


class Columns:
    """Columns of one frame by name, each the words of a text or an array."""

    def __init__(self, columns: Mapping[str, Any], stated: bool = False) -> None:
        """`stated`: see `rounding`."""
        self._columns, self._stated = columns, stated

    @classmethod
    def of_rows(
        cls, rows: Sequence[Sequence[str]], names: Mapping[str, int], count: int, stated: bool = False
    ) -> Columns:
        """Columns of rows of words, each `count` long; `names`: place of a column by its name."""
        wrong = next((k for k, row in enumerate(rows) if len(row) != count), None)
        if wrong is not None:
            said = f"row {wrong + 1} of {len(rows)}, {' '.join(rows[wrong])!r:.60}, has {len(rows[wrong])} columns"
            raise ValueError(f"{said}, {count} expected")
        return cls({name: [row[k] for row in rows] for name, k in names.items()}, stated)

    def __contains__(self, name: str) -> bool:
        return name in self._columns

    def names(self) -> list[str]:
        """Names of all columns."""
        return list(self._columns)

    def __len__(self) -> int:
        return len(next(iter(self._columns.values())))

    def words(self, name: str) -> list[str]:
        """A column as text."""
        return [value if isinstance(value, str) else f"{value:.15g}" for value in self._columns[name]]

    def numbers(self, name: str) -> Array:
        """A column as float64, all finite."""
        column = self._columns[name]
        if isinstance(column, np.ndarray):
            values = np.asarray(column, dtype=np.float64)
        else:
            try:
                values = np.array(list(map(float, column)), dtype=np.float64)
            except ValueError:
                values = np.array([self._number(name, k) for k in range(len(column))])
        if not np.isfinite(values).all():
            k = int(np.flatnonzero(~np.isfinite(values))[0])
            raise DamageError(f"{name} of row {k + 1} is {column[k]}, no finite number")
        return values

    def _number(self, name: str, k: int) -> float:
        try:
            return number(self._columns[name][k])
        except DamageError as error:
            raise DamageError(f"{name} of row {k + 1}: {error}") from None

    def whole(self, name: str) -> Indices:
        """A column as int64."""
        values = self.numbers(name)
        if len(wrong := np.flatnonzero((values != np.rint(values)) | (np.abs(values) > 2.0**53))):
            raise ValueError(f"{name} of row {wrong[0] + 1} is {self._columns[name][wrong[0]]}: whole numbers expected")
        return values.astype(np.int64)

    def points(self, *names: str) -> Array:
        """(n, k) columns side by side."""
        return np.column_stack([self.numbers(name) for name in names])

    def error(self, *names: str, chosen: bool = False) -> float:
        """How far numbers of these columns may be off for their digits."""
        values, first = self.points(*names), self._columns[names[0]]
        if isinstance(first, np.ndarray):
            return rounding_of(first.dtype, values)
        words = zip(*(self._columns[name][: DIGITS.sample] for name in names), strict=True)
        return rounding([word for row in words for word in row], values, chosen=chosen, stated=self._stated)

    def taken(self, rows: Indices | NDArray[np.bool_]) -> Columns:
        """The same of some rows, by mask or by number."""
        kept = np.arange(len(self))[rows]
        chosen = {
            name: values[kept] if isinstance(values, np.ndarray) else [values[k] for k in kept]
            for name, values in self._columns.items()
        }
        return Columns(chosen, self._stated)

    def renamed(self, old: str, new: str) -> Columns:
        """The same with another name of one column."""
        names = {name: new if name == old else name for name in self._columns}
        return Columns({names[name]: values for name, values in self._columns.items()}, self._stated)

    def by_id(self, name: str = "id") -> Columns:
        """The same in the order of a column that names the particles."""
        named = self.whole(name)
        ids, counts = np.unique(named, return_counts=True)
        if (counts > 1).any():
            twice = ids[counts > 1][0]
            raise InputError(f"{name} {twice} stands on {counts.max()} rows of one frame: it must be unique")
        return self.taken(np.argsort(named))

    def common(self, name: str) -> float:
        """The number that all rows have in a column."""
        if isinstance(column := self._columns[name], list) and len(set(column)) == 1:
            return float(Columns({name: column[:1]}).numbers(name)[0])
        values = self.numbers(name)
        if len(other := np.flatnonzero(values != values[0])):
            said = f"{column[0]} on one atom and {column[other[0]]} on another"
            raise InputError(f"{name} is {said}: they must be equal")
        return float(values[0])

    def types(self) -> NDArray[np.str_]:
        """(n,) names of types; "1" where none are given."""
        kind = next((name for name in ("type", "species", "element") if name in self), None)
        return np.array(["1"] * len(self) if kind is None else self.words(kind))

    def radius(self) -> tuple[Array | None, float]:
        """(n,) radii, None without, and how far they may be off; several columns must say the same."""
        found = {name: factor * self.numbers(name) for name, factor in SIZE_NAMES.items() if name in self}
        error = sum(SIZE_NAMES[name] * self.error(name, chosen=True) for name in found)
        if not found and DISK_AREA in self:
            found = {DISK_AREA: np.sqrt(self.numbers(DISK_AREA) / np.pi)}
            error = self.error(DISK_AREA, chosen=True) / (2 * np.pi * float(found[DISK_AREA].mean()))
        first = next(iter(found), "")
        for other in [*found][1:]:
            wrong = np.flatnonzero(np.abs(found[other] - found[first]) > DIGITS.same_size * np.abs(found[first]))
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
        if DISK_AREA in self and not any(name in self for name in SIZE_NAMES):
            more.setdefault("provenance", {"sizes": "of disks of the areas in the table"})
        return Sites(box, places, self.types(), radius=radius, rounding=rounding, **more)
