"""Numbers in text files of LAMMPS: tables, boxes, and how many digits they were written with."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from jamlab.arrays import Array
from jamlab.errors import JamlabError, StorageError
from jamlab.storage.verified_file import FilePath

FULL_DIGITS = 15  # numbers of full precision rarely end in more than two zeros; LAMMPS writes 6 by default
_CHOSEN_DIGITS = 4  # sizes and boxes of no more are taken for numbers that somebody chose
_SAMPLE = 500  # coordinates that are looked at


@contextmanager
def text_of(path: FilePath) -> Iterator[Iterator[str]]:
    """Lines of a text file; errors in reading them are those of `damage_named`."""
    with damage_named(path), open(path, encoding="ascii") as file:
        yield iter(file)


@contextmanager
def damage_named(path: FilePath) -> Iterator[None]:
    """Turn whatever a damaged file leads to into a `StorageError` that names the file."""
    try:
        yield
    except JamlabError as error:
        raise type(error)(f"{path}: {error}") from error
    except OSError as error:
        raise StorageError(f"cannot read {path}: {error.strerror}; check the name and its permissions") from error
    except (ValueError, LookupError, TypeError, OverflowError) as error:
        raise StorageError(f"{path} is damaged or cut off ({error}): copy it or write it again") from error


def numbers(words: Sequence[Sequence[str]], column: int) -> Array:
    """One column of rows of words as float64."""
    values = np.array([float(row[column]) for row in words])
    if not np.isfinite(values).all():
        raise ValueError(f"{words[int(np.flatnonzero(~np.isfinite(values))[0])][column]} is no finite number")
    return values


def whole_numbers(words: Sequence[Sequence[str]], column: int) -> NDArray[np.int64]:
    """One column of rows of words as int64; errors as in `numbers`."""
    return np.array([int(row[column]) for row in words], dtype=np.int64)


def rounding(words: Sequence[str], values: Array, *, chosen: bool = False) -> float:
    """How far numbers may be off because they were written with few digits, seen from some words; 0 for the digits of
    float64. Sizes and boxes may be chosen by hand: 0.7 is meant, 0.583333 is rounded."""
    digits = max(len(word.lower().partition("e")[0].lstrip("+-0.").replace(".", "")) for word in words[:_SAMPLE])
    largest = float(np.abs(values).max())
    if digits >= FULL_DIGITS or not largest or (chosen and digits <= _CHOSEN_DIGITS):
        return 0.0
    return float(0.5 * 10.0 ** (np.floor(np.log10(largest)) + 1 - max(digits, 1)))
