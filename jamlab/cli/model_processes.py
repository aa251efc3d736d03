"""Run one function for several models side by side, in processes that die with this one.

Each has LAMMPS, which cannot run twice in one process, and reports through a pipe of its own.
"""

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from typing import Any, TypeVar

from jamlab.campaign.worker_process import die_with
from jamlab.errors import EngineError

_SIGNALS = (signal.SIGINT, signal.SIGTERM)
T = TypeVar("T")
Report = Callable[[str, float], None]


def run_side_by_side(
    run: Callable[[str, Report], T], models: Sequence[str], progress: Mapping[str, Report]
) -> dict[str, T]:
    """Call `run(model, report)` for every model at once.

    Args:
        run: function that can be pickled, as can what it returns and raises.
        models: one process for each.
        progress: model -> function called in this process with what `run` reports.

    Returns:
        Model -> what `run` returned.

    Raises:
        Whatever `run` raises; the other processes are killed.
        EngineError: a process was killed.
    """
    context = multiprocessing.get_context("spawn")  # a fork would share what LAMMPS and MPI hold
    running: dict[Connection, str] = {}
    processes = []
    found: dict[str, T] = {}
    try:
        for model in models:
            receiver, sender = context.Pipe(duplex=False)
            process = context.Process(target=_serve, args=(run, model, sender, os.getpid()), daemon=True)
            with _without_interrupts(), sender:  # closed here, so that a process that dies ends its pipe
                process.start()
            processes.append(process)
            running[receiver] = model
        while running:
            ready = wait(list(running))
            for receiver in [each for each in running if each in ready]:
                model = running[receiver]
                kind, content = _receive(receiver, model)
                if kind == "progress":
                    progress[model](*content)
                elif kind == "error":
                    raise content
                else:
                    found[model] = content
                    del running[receiver]
    finally:
        for process in processes:
            process.kill()
        for process in processes:
            process.join()
    return {model: found[model] for model in models}


def _receive(receiver: Connection, model: str) -> tuple[str, Any]:
    try:
        kind, content = receiver.recv()
    except (EOFError, ConnectionError):
        raise EngineError(f"the process of model {model} was killed: free some memory, and run again") from None
    return kind, content


def _serve(run: Callable[[str, Report], T], model: str, sender: Connection, parent: int) -> None:
    die_with(parent)
    try:
        result = run(model, lambda *step: sender.send(("progress", step)))
    except Exception as error:  # whatever it is, the parent raises it
        sender.send(("error", error))
    else:
        sender.send(("result", result))


@contextmanager
def _without_interrupts() -> Iterator[None]:
    """Start processes that Ctrl-C, which reaches the whole process group, does not end: the parent ends them.

    A signal that comes meanwhile is taken up afterwards, or the child, its parent gone, would print a traceback. The
    mask is for the child; the handlers are for other threads of this process, which have no mask.
    """
    resource_tracker.ensure_running()  # its start, otherwise part of the first child's, takes the mask away
    came: list[int] = []
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    handlers = {number: signal.signal(number, lambda n, _: came.append(n)) for number in _SIGNALS}
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
    for late in came:
        signal.raise_signal(late)
