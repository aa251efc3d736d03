"""What results have in common: one short line at the prompt, a table in notebooks, a pandas table of what they hold."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from jamlab.hints import Hinted

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Shown:
    """What a notebook shows of a result."""

    characters: int = 60  # characters of one value
    rows: int = 8  # rows of a table in a notebook


SHOWN = Shown()

_PAIR, _ENDS = ("i", "j"), ("_x", "_y")  # columns of pairs of particles, and of vectors


class Result(Hinted):
    """Base of all results, which are dataclasses.

    Example:
        >>> s = jamlab.complex_modulus(jamlab.pack(n=32, pressure=1e-2, seed=1), [1e-3, 1.0], prestress=False)
        >>> list(s.to_dataframe().columns)
        ['omega', 'storage', 'loss', 'error_bound']
    """

    _rows: ClassVar[tuple[str, ...]] = ()  # attributes that are columns of its table
    _apart: ClassVar[tuple[str, ...]] = ()  # arrays that are too large to stand beside a table whose rows they are not

    def __init_subclass__(cls) -> None:
        if "__repr__" not in vars(cls):  # else a dataclass would write its own
            cls.__repr__ = cls.__repr__  # type: ignore[method-assign]

    def __repr__(self) -> str:
        shown = [each for each in fields(self) if each.repr]  # type: ignore[arg-type]  # every result is a dataclass
        return (
            f"{type(self).__name__}({', '.join(f'{each.name}={_shorten(getattr(self, each.name))}' for each in shown)})"
        )

    def _repr_html_(self) -> str:
        table = self.to_dataframe()
        text = repr(self).replace("<", "&lt;").replace(">", "&gt;")
        return f"<p>{text}</p>{table.head(SHOWN.rows).to_html() if len(table) else ''}"

    def to_dataframe(self) -> pd.DataFrame:
        """What the result holds one by one, a row each: contacts, frequencies, rates, particles, as its class declares.

        Columns have the names of attributes; of vectors with `_x` and `_y` behind, of pairs of particles i and j. In
        `.attrs` of the table are the numbers beside them; arrays with other rows are named there under "not_in_table".

        Returns:
            pandas DataFrame; one row where a result is one set of numbers.
        """
        import pandas as pd

        columns: dict[str, Any] = {}
        declared = self._columns()
        for name, values in declared.items():
            array = np.asarray(values)
            if array.ndim == 2:
                ends = _PAIR if name == "pairs" else [f"{name}{end}" for end in _ENDS]
                columns |= dict(zip(ends, array.T, strict=True))
            else:
                columns[name] = values
        beside = {each.name: getattr(self, each.name) for each in fields(self)}  # type: ignore[arg-type]  # as above
        plain: dict[Any, Any] = {name: value for name, value in beside.items() if np.isscalar(value)}
        table = pd.DataFrame(columns) if columns else pd.DataFrame([plain])
        seen = {*self._rows, *declared, *self._apart}
        lists = {k: v.tolist() for k, v in beside.items() if isinstance(v, np.ndarray) and k not in seen}
        table.attrs = plain | lists | ({"not_in_table": list(self._apart)} if self._apart else {})
        if packing := self.__dict__.get("packing"):
            table.attrs["units"] = packing.unit_names._asdict()
        return table

    def _columns(self) -> dict[str, Any]:
        """Columns of the table: arrays (rows,), or (rows, 2)."""
        return {name: getattr(self, name) for name in self._rows}


def _shorten(value: Any) -> str:
    if isinstance(value, np.ndarray) and value.ndim:
        return f"{value.shape} {value.dtype}"
    if isinstance(value, float | np.floating):
        return f"{value:.6g}"
    text = repr(value)
    if isinstance(value, Mapping) or (isinstance(value, list | tuple) and len(text) > SHOWN.characters):
        return f"<{len(value)} entries>"
    return text if len(text) <= SHOWN.characters else f"<{type(value).__name__}>"
