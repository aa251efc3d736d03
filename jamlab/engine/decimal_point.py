"""LAMMPS reads and prints numbers by the locale of its thread: with a decimal point, whatever locale a host has set.

Qt, GTK and R set the locale of the user; with a decimal comma LAMMPS takes no number. The locale is changed for the
thread that calls, and only while it calls.
"""

import ctypes
from types import TracebackType

_ALL_CATEGORIES = 0x1FBF  # LC_ALL_MASK of glibc
_libc = ctypes.PyDLL(None)
_libc.newlocale.restype, _libc.newlocale.argtypes = ctypes.c_void_p, (ctypes.c_int, ctypes.c_char_p, ctypes.c_void_p)
_libc.uselocale.restype, _libc.uselocale.argtypes = ctypes.c_void_p, (ctypes.c_void_p,)
_C = _libc.newlocale(_ALL_CATEGORIES, b"C", None)


class DecimalPoint:
    """A block in which C reads and prints numbers with a decimal point; it costs less than a microsecond."""

    __slots__ = ("_before",)

    def __enter__(self) -> None:
        self._before = _libc.uselocale(_C)

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        _libc.uselocale(self._before)
