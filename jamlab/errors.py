"""Every error that a user of jamlab can cause.

Each one is a `JamlabError` and also the built-in error it resembles, names the offending value and says what to do.
"""


class JamlabError(Exception):
    """Base of all jamlab errors."""


class InputError(JamlabError, ValueError):
    """A value that no run can start from."""


class SelfCrossingError(InputError):
    """A polygon that has folded over itself."""


class BoundaryError(InputError):
    """Outlines that cross, or meet in one point in a way that rounding cannot tell apart."""


class EngineError(JamlabError, RuntimeError):
    """LAMMPS refused or is not usable."""


class ConvergenceError(JamlabError, RuntimeError):
    """A method ended before it met its tolerance."""


class StorageError(JamlabError, OSError):
    """A file that is missing, foreign or cannot be written."""
