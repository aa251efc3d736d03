"""Represent objects that hold arrays by one short line, for the prompt and for notebooks."""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

_LONGEST = 60  # characters of one value


def short_repr(self: Any) -> str:
    """Represent a dataclass with shapes in the place of arrays; stands as `__repr__ = short_repr` in its body.

    >>> jamlab.Modes(np.zeros(3), np.zeros((3, 8, 2)))
    Modes(eigenvalues=(3,) float64, vectors=(3, 8, 2) float64)
    """
    parts = [f"{f.name}={_shorten(getattr(self, f.name))}" for f in fields(self) if f.repr]
    return f"{type(self).__name__}({', '.join(parts)})"


def _shorten(value: Any) -> str:
    if isinstance(value, np.ndarray) and value.ndim:
        return f"{value.shape} {value.dtype}"
    if isinstance(value, float | np.floating):
        return f"{value:.6g}"
    if is_dataclass(value) and not isinstance(value, type):
        text = repr(value)
        return text if len(text) <= _LONGEST else f"<{type(value).__name__}>"
    if isinstance(value, Mapping):
        return f"<{len(value)} entries>"
    if isinstance(value, list | tuple) and len(repr(value)) > _LONGEST:
        return f"<{len(value)} entries>"
    text = repr(value)
    return text if len(text) <= _LONGEST else f"<{type(value).__name__}>"
