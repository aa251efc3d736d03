"""Executors whose workers are processes that end in many ways, a fork of the tests each: to start one costs 10 ms."""

import os
import pickle
import random
import signal
import warnings
from concurrent.futures import Executor, Future


def in_a_fork(function, *arguments):
    """Call a function in a process of its own; returns how that ended, 0 if in order, and what was returned."""
    ours, theirs = os.pipe()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # threads of BLAS, which the other process does not use
        process = os.fork()
    if process == 0:
        try:
            with open(theirs, "wb") as pipe:
                pickle.dump(function(*arguments), pipe)
            os._exit(0)
        finally:
            os._exit(70)
    os.close(theirs)
    with open(ours, "rb") as pipe:
        content = pipe.read()
    code = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
    return code, pickle.loads(content) if code == 0 else None


class Worker(Executor):
    """One worker, which is replaced when it dies."""

    _max_workers = 1

    def submit(self, function, /, *arguments):
        future = Future()
        code, answer = self.call(function, arguments)
        future.set_result(answer) if code == 0 else future.set_exception(OSError(f"its process ended with {code}"))
        return future

    def call(self, function, arguments):
        return in_a_fork(function, *arguments)


class KilledAtRandom(Worker):
    """One of so many calls is killed, at any moment of the seconds that it takes."""

    def __init__(self, share, seconds, seed=0):
        self.random, self.share, self.seconds, self.kills = random.Random(seed), share, seconds, 0

    def call(self, function, arguments):
        moment = self.seconds * self.random.random() if self.random.random() < self.share else None

        def call():
            if moment is not None:
                signal.signal(signal.SIGALRM, signal.SIG_DFL)  # which the kernel answers by the end of the process
                signal.setitimer(signal.ITIMER_REAL, max(moment, 1e-6))
            return function(*arguments)

        code, answer = in_a_fork(call)
        self.kills += code == -signal.SIGALRM
        return code, answer


class BeganAgain(Worker):
    """Calls a function up to four times before it gives up, as Dask does on its own."""

    def call(self, function, arguments):
        for _ in range(4):
            code, answer = in_a_fork(function, *arguments)
            if code == 0:
                break
        return code, answer


class CutOff(Worker):
    """Takes the first worker of each of the first few calls for dead, which goes on and ends when all is over."""

    def __init__(self, count):
        self.count, self.cut_off = count, []

    def call(self, function, arguments):
        if len(self.cut_off) < self.count:
            self.cut_off.append((function, arguments))
            return 1, None
        return 0, function(*arguments)
