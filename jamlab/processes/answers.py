"""Answer a call from another process: what a function returns or raises, as bytes that can be read there."""

import functools
import os
import pickle
import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TextIO

from jamlab.errors import EngineError, InputError, JamlabWarning
from jamlab.processes.memory import memory_limits

Tell = Callable[[str, bytes], None]  # kind, "report" or "warning", and content, of what is told while a call runs


def sent(content: Any, what: str) -> bytes:
    """A function or its item as bytes for another process; functions of the script or notebook that runs are sent whole
    where `cloudpickle` is loaded, as Dask and loky do."""
    try:
        plain = pickle.dumps(content)
    except Exception as error:  # whatever an object raises as it is pickled
        plain, why = b"", str(error)
    if plain and b"__main__" not in plain:
        return plain
    if whole := sys.modules.get("cloudpickle"):
        return bytes(whole.dumps(content))
    if not plain:
        raise InputError(f"{what} cannot be sent to another process ({why}): define it in a module, without lambdas")
    return plain


def answer(function: bytes, item: bytes, tell: Tell) -> tuple[str, bytes]:
    """Call `function(item, report)`; returns what the end is, and its content for `read_answer`: "result" and what is
    returned, "error" and what is raised, "exit" and the exit code with which the function would end the process.

    Args:
        function: as `sent`; reports through its second argument while it runs.
        item: as `sent`, its first argument.
        tell: called with "report" and the tuple that is reported as bytes, and with "warning" and the arguments of
            `jamlab.errors.warn` as bytes.
    """
    try:
        called, given = _loaded(function), pickle.loads(item)
    except Exception as error:  # whatever an object raises as it is made
        return "error", pickle.dumps(_unreadable("a call", error))
    try:
        with _telling_warnings(tell):
            found = called(given, lambda *step: tell("report", sent(step, "a report")))
    except SystemExit as end:
        return "exit", pickle.dumps(end.code if isinstance(end.code, int) else int(end.code is not None))
    except MemoryError as error:
        said = f"out of memory, of which there are {memory_limits()}" + f" ({error})" * bool(str(error))
        return "error", pickle.dumps(EngineError(f"{said}: use fewer processes, or allow more"))
    except Exception as error:  # whatever it is, the caller raises it
        return "error", _dump_error(error)
    try:
        return "result", pickle.dumps(found)
    except Exception as error:  # whatever an object raises as it is pickled
        said = f"a result of type {type(found).__name__} cannot be sent between processes ({error})"
        return "error", pickle.dumps(EngineError(f"{said}: return numbers, arrays, or objects of a module's classes"))


def read_answer(kind: str, content: bytes) -> tuple[str, Any]:
    """What `answer` says, in the process that called."""
    try:
        return kind, pickle.loads(content)
    except Exception as error:  # whatever an object raises as it is made
        return "error", _unreadable(f"the {kind} of a call", error)


@functools.lru_cache(maxsize=1)  # one function is called for many items
def _loaded(function: bytes) -> Callable[..., Any]:
    found: Callable[..., Any] = pickle.loads(function)
    return found


def _unreadable(what: str, error: Exception) -> EngineError:
    said = f"{what} cannot be read on {os.uname().nodename} ({type(error).__name__}: {error})"
    return EngineError(f"{said}: install the same versions of Python, jamlab and your modules here and there")


def _dump_error(error: Exception) -> bytes:
    """An error as bytes, or what it says if it cannot be made again from bytes."""
    try:
        content = pickle.dumps(error)
        pickle.loads(content)
    except Exception:  # whatever a class of a stranger raises
        import traceback  # takes milliseconds of the start of each process

        plain = EngineError(f"{type(error).__name__}: {error}")
        plain.add_note("".join(traceback.format_exception(error)))
        return pickle.dumps(plain)
    return content


@contextmanager
def _telling_warnings(tell: Tell) -> Iterator[None]:
    """Hand on the warnings of this thread, which the caller issues at the line of its own caller."""
    own = threading.get_ident()
    with warnings.catch_warnings():
        warnings.simplefilter("always", JamlabWarning)
        usual = warnings.showwarning

        def show(
            message: Warning | str,
            category: type[Warning],
            filename: str,
            lineno: int,
            file: TextIO | None = None,
            line: str | None = None,
        ) -> None:
            if threading.get_ident() == own:
                tell("warning", pickle.dumps((str(message), _known_everywhere(category))))
            else:
                usual(message, category, filename, lineno, file, line)

        warnings.showwarning = show
        yield


def _known_everywhere(category: type[Warning]) -> type[Warning]:
    """The class of a warning, or its first base that a process can import that lacks the modules of this one."""
    return next(each for each in category.__mro__ if each.__module__ in ("builtins", JamlabWarning.__module__))
