"""What results have in common: one short line at the prompt, a table in notebooks, a pandas table of their arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np

from jamlab.old_names import OF_RESULTS, hint

if TYPE_CHECKING:
    import pandas as pd

_LONGEST = 60  # characters of one value
_MOST_COLUMNS = 4  # of an array (rows, columns) that a table takes in
_SHOWN = 8  # rows of a table in a notebook


class Result:
    """Base of all results, which are dataclasses.

    Example:
        >>> s = jamlab.complex_modulus(jamlab.pack(n=32, pressure=1e-2, seed=1), [1e-3, 1.0], prestress=False)
        >>> list(s.to_dataframe().columns)
        ['omega', 'storage', 'loss', 'error_bound']
    """

    def __init_subclass__(cls) -> None:
        if "__repr__" not in vars(cls):  # else a dataclass would write its own
            cls.__repr__ = cls.__repr__  # type: ignore[method-assign]

    def __repr__(self) -> str:
        shown = [each for each in fields(self) if each.repr]  # type: ignore[arg-type]  # every result is a dataclass
        return (
            f"{type(self).__name__}({', '.join(f'{each.name}={_shorten(getattr(self, each.name))}' for each in shown)})"
        )

    if not TYPE_CHECKING:  # else every name would be an attribute

        def __getattr__(self, name: str) -> Any:
            if name.startswith("__"):
                raise AttributeError(name)
            use = hint(name, [each for each in dir(type(self)) if each[0] != "_"], OF_RESULTS)
            raise AttributeError(f"a {type(self).__name__} has no attribute {name!r}{use}", name=name)

    def _repr_html_(self) -> str:
        table = self.to_dataframe()
        text = repr(self).replace("<", "&lt;").replace(">", "&gt;")
        return f"<p>{text}</p>{table.head(_SHOWN).to_html() if len(table) else ''}"

    def to_dataframe(self) -> pd.DataFrame:
        """Arrays of the result as columns, a row for each entry; numbers beside them are in `.attrs` of the table.

        The first array of the result decides the number of rows. An array of another length is left out, and one of
        shape (rows, k) has a column for each k up to 4. A result without arrays is a table of one row.
        """
        import pandas as pd

        values = {each.name: getattr(self, each.name) for each in fields(self)}  # type: ignore[arg-type]  # as above
        arrays = {name: value for name, value in values.items() if isinstance(value, np.ndarray) and value.ndim}
        plain: dict[Any, Any] = {name: value for name, value in values.items() if np.isscalar(value)}
        if not arrays:
            return pd.DataFrame([plain])
        rows = len(next(iter(arrays.values())))
        columns: dict[str, Any] = {}
        for name, array in arrays.items():
            if len(array) == rows and array.ndim == 1:
                columns[name] = array
            elif len(array) == rows and array.ndim == 2 and array.shape[1] <= _MOST_COLUMNS:
                columns |= {f"{name}_{k}": array[:, k] for k in range(array.shape[1])}
        table = pd.DataFrame(columns)
        table.attrs = plain
        return table


def _shorten(value: Any) -> str:
    if isinstance(value, np.ndarray) and value.ndim:
        return f"{value.shape} {value.dtype}"
    if isinstance(value, float | np.floating):
        return f"{value:.6g}"
    text = repr(value)
    if isinstance(value, Mapping) or (isinstance(value, list | tuple) and len(text) > _LONGEST):
        return f"<{len(value)} entries>"
    return text if len(text) <= _LONGEST else f"<{type(value).__name__}>"
