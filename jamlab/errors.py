"""Every error that a user of jamlab can cause, and the warning.

Each error is a `JamlabError` and also the built-in error it resembles, names the offending value and says what to do.
"""

import sys
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from types import FrameType, MappingProxyType


class JamlabError(Exception):
    """Base of all jamlab errors.

    Example:
        >>> try:
        ...     jamlab.jam(n=7)
        ... except jamlab.JamlabError as error:
        ...     print(error)
        n = 7: half of the particles are large, so n must be an even number, 2 or more
    """


class InputError(JamlabError, ValueError):
    """An invalid argument or file content.

    Example:
        >>> try:
        ...     jamlab.pack(n=32, pressure=-1.0)
        ... except jamlab.InputError as error:
        ...     print(isinstance(error, ValueError), error)
        True pressure = -1.0: must be a number above 0 and at most 0.3
    """


class ArgumentError(InputError, TypeError):
    """An unknown argument of a function.

    Example:
        >>> try:
        ...     jamlab.jam(n=16, random_state=3)
        ... except jamlab.ArgumentError as error:
        ...     print(isinstance(error, TypeError), error)
        True jam has no argument 'random_state': use `seed`
    """


class SelfCrossingError(InputError):
    """A polygon that has folded over itself.

    Example:
        >>> bow = [[1.0, 1.0], [2.0, 2.0], [2.0, 1.0], [1.0, 2.0]]
        >>> law = {"gamma": 0.4, "ka": 300.0, "eps": 1.0, "delta": 0.25, "eta": 0.0, "contact": "outline", "a0": [1.0]}
        >>> try:
        ...     jamlab.Packing("dp", [[4.0, 0.0], [0.0, 4.0]], bow, law, offsets=[0, 4])
        ... except jamlab.SelfCrossingError as error:
        ...     print(error)
        edges of polygon 0 cross each other: its outline must be simple
    """


class BoundaryError(InputError):
    """Particle boundaries that cross, or meet in one point within rounding.

    Example:
        >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
        >>> law = {"gamma": 0.4, "ka": 300.0, "eps": 1.0, "delta": 0.25, "eta": 0.0, "contact": "outline"}
        >>> law["a0"] = [1.0, 1.0]
        >>> both = np.vstack([square, square + 0.6])
        >>> crossed = jamlab.Packing("dp", [[6.0, 0.0], [0.0, 6.0]], both, law, offsets=[0, 4, 8])
        >>> try:
        ...     jamlab.voids(crossed)
        ... except jamlab.BoundaryError as error:
        ...     print(error)
        outlines of polygons 0 and 1 cross: separate them; only their rims may overlap
    """


class EngineError(JamlabError, RuntimeError):
    """LAMMPS reported an error or cannot be used.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> with jamlab.Session(p) as session:
        ...     try:
        ...         session.command("pair_style none_such")
        ...     except jamlab.EngineError as error:
        ...         print(str(error)[:60])
        LAMMPS stopped at `pair_style none_such`: ERROR: Unrecognize
    """


class ConvergenceError(JamlabError, RuntimeError):
    """A method did not converge to its tolerance.

    Example:
        >>> p = jamlab.Packing("sp", [[3.0, 0.0], [0.0, 3.0]], [[0.5, 0.5], [1.4, 0.5]], {"k": 1.0}, "k", [1.0, 1.0])
        >>> try:
        ...     jamlab.shear_modulus(p)
        ... except jamlab.ConvergenceError as error:
        ...     print(error)
        every particle is a rattler: the packing is unjammed and has no elastic modulus
    """


class StorageError(JamlabError, OSError):
    """A file that is missing, unreadable or cannot be written.

    Example:
        >>> try:
        ...     jamlab.read("none-such.h5")
        ... except jamlab.StorageError as error:
        ...     print(isinstance(error, OSError), error)
        True cannot read none-such.h5: No such file or directory; check the name and its permissions
    """


class JamlabWarning(UserWarning):
    """A correct result that may be unexpected.

    Example:
        >>> import warnings
        >>> with warnings.catch_warnings():
        ...     warnings.simplefilter("error", jamlab.JamlabWarning)
        ...     p = jamlab.pack(n=16, pressure=5e-3, seed=1)
        ...     try:
        ...         jamlab.complex_modulus(p, [1.0])
        ...     except jamlab.JamlabWarning as warning:
        ...         print(str(warning).partition(" (")[2])
        n = 16, phi = 0.84610707) is unstable to shear at this box shape. Use the ensemble 'shear-stabilized'
    """


# option of each argument of the command that runs; None: there is none, Python is
_OPTIONS: ContextVar[Mapping[str, str] | None] = ContextVar("options", default=None)


@contextmanager
def naming_options(options: Mapping[str, str] = MappingProxyType({})) -> Iterator[None]:
    """Let messages name options of the shell instead of arguments of Python.

    Args:
        options: of the command that runs, by the names of the arguments.
    """
    before = _OPTIONS.set(options)
    try:
        yield
    finally:
        _OPTIONS.reset(before)


def typed(python: str, shell: str) -> str:
    """What the reader of a message is to type: in Python, or in the shell if a command runs."""
    return python if _OPTIONS.get() is None else shell


def named(name: str, value: object, form: str = "") -> str:
    """An argument with its value, in a format, as the option if the command that runs has it."""
    option, shown = (_OPTIONS.get() or {}).get(name), format(value, form) if form else repr(value)
    return f"{name} = {shown}" if option is None else f"{option} {shown if form else value}"


def warn(message: str, category: type[Warning] = JamlabWarning) -> None:
    """Warn at the line of the user that led here, however many functions of jamlab and of libraries lie between.

    Args:
        message: what may be unexpected. Python shows one text once a line of code, so name the value.
        category: class of the warning. Default: `JamlabWarning`.
    """
    frames, last = [], sys._getframe(1)
    while last:
        frames.append(last)
        last = last.f_back  # type: ignore[assignment]  # None ends it
    outside = [each for each in frames if _package(each) != "jamlab"] or frames
    users = [each for each in outside if _package(each) not in _LIBRARIES] or outside  # a thread has none
    place = users[0]
    known = place.f_globals.setdefault("__warningregistry__", {})
    name = place.f_globals.get("__name__") or "<unknown>"
    warnings.warn_explicit(message, category, place.f_code.co_filename, place.f_lineno, name, known)


def _package(frame: FrameType) -> str:
    return str(frame.f_globals.get("__name__")).partition(".")[0]


# packages that call a function for somebody else: their lines are no caller's
_LIBRARIES = sys.stdlib_module_names | {
    *("numpy", "scipy", "pandas", "MDAnalysis", "matplotlib"),
    *("typer", "click", "pydantic", "pydantic_core", "rich", "joblib", "tqdm"),
    *("dask", "distributed", "dask_jobqueue", "tornado", "loky"),
}
