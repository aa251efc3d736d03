"""Types of numpy arrays, each with a marker that says what it holds; the checks of arguments read the marker.

How numpy builds its own aliases differs between releases, so nothing may look inside them.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy import typing as npt
from numpy.typing import NDArray


@dataclass(frozen=True)
class Holds:
    """What an argument that becomes an array may hold."""

    kinds: str  # codes of `numpy.dtype.kind`
    text: str  # the same for a message


_NUMBERS = Holds("iuf", "numbers")

Array = Annotated[NDArray[np.float64], _NUMBERS]
ArrayLike = Annotated[npt.ArrayLike, _NUMBERS]  # what numpy makes an array of: a number, nested lists, an array
Complex = Annotated[NDArray[np.complex128], Holds("iufc", "numbers, complex ones too")]
Indices = Annotated[NDArray[np.int64], Holds("iu", "an array of whole numbers")]
Mask = Annotated[NDArray[np.bool_], Holds("b", "an array of truth values")]
