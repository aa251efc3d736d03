"""Calls through executors of others: the same answers as in own processes, and faults that are named."""

import contextlib
import os
import pickle
import signal
import sys
import threading
import time
import warnings
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor

import numpy as np
import psutil
import pytest
from executors import InThisProcess, local_dask, loky, pool, running_dask

import jamlab
from jamlab.errors import EngineError, InputError, JamlabWarning
from jamlab.processes import executor as module
from jamlab.processes.children import Children
from jamlab.processes.death import Death
from jamlab.processes.executor import OnExecutor
from jamlab.processes.letterbox import Letterbox, Sender
from jamlab.processes.side_by_side import crew, run_side_by_side

CALLS = """
import os, signal, sys, threading, time
from jamlab.errors import InputError, warn
from jamlab.processes.cores import available_cores
from jamlab.processes.side_by_side import run_side_by_side

class TwoWords(Exception):
    def __init__(self, one, other):
        super().__init__(f"{one} {other}")

class Unreadable:
    def __reduce__(self):
        return int, ("no number",)

def act(item, report):
    report(item, "begun")
    if item == "exit":
        sys.exit(7)
    if item == "raise":
        raise TwoWords("odd", "error")
    if item == "memory":
        raise MemoryError
    if item == "lambda":
        return lambda: item
    if item == "unreadable":
        return Unreadable()
    if item == "report":
        report(lambda: item)
    if item == "warn":
        warn("a warning of a call")
    if item == "surroundings":
        return available_cores(), os.environ["OMP_NUM_THREADS"]
    if item == "nested":
        return run_side_by_side(act, [1, 2], 2)
    return item

def die_once(item, report):
    file, number = item
    if number == 0 and not os.path.exists(file):
        open(file, "w").close()
        time.sleep(0.3)  # the other worker has begun
        os.kill(os.getpid(), signal.SIGKILL)
    return number

def linger(item, report):
    report(os.getpid())
    time.sleep(item)
    return item
"""


@pytest.fixture
def calls(tmp_path, monkeypatch):
    (tmp_path / "own_calls.py").write_text(CALLS)
    monkeypatch.syspath_prepend(tmp_path)
    import own_calls

    yield own_calls
    del sys.modules["own_calls"]


def ends(workers, count):
    """What comes of so many calls, by their keys; reports aside."""
    found = {}
    while len(found) < count:
        key, kind, content = workers.wait()
        if kind != "report":
            found[key] = kind, content
    return found


@pytest.mark.parametrize("start", [lambda function: OnExecutor(function, InThisProcess()), lambda f: Children(f, 1)])
def test_ends_of_calls_are_the_same_in_own_processes_and_in_others(calls, start, monkeypatch):
    """Errors that cannot be made again, results that cannot be sent or read, and functions that exit."""
    monkeypatch.delitem(sys.modules, "cloudpickle", raising=False)  # which Dask loads, and which sends lambdas
    items = ["exit", "raise", "memory", "lambda", "unreadable", "report", "warn", "surroundings"]
    with pytest.warns(JamlabWarning, match="a warning of a call"), start(calls.act) as workers:
        for item in items:
            workers.submit(item, item)
        found = ends(workers, len(items))
    assert found.pop("exit") == ("death", Death("exit", "exit code 7: a called function exited", True, 7))
    assert found.pop("warn") == ("result", "warn") and found.pop("surroundings") == ("result", (1, "1"))
    assert {kind for kind, _ in found.values()} == {"error"}
    texts = {item: str(error) for item, (_, error) in found.items()}
    assert texts["raise"] == "TwoWords: odd error" and "TwoWords" in found["raise"][1].__notes__[0]
    assert "out of memory" in texts["memory"] and " GB " in texts["memory"]
    assert "type function cannot be sent" in texts["lambda"] and "a report cannot be sent" in texts["report"]
    assert "cannot be read" in texts["unreadable"] and "no number" in texts["unreadable"]


def test_the_surroundings_of_a_worker_are_as_before(calls, monkeypatch):
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    before = os.environ.copy(), list(sys.path)
    assert run_side_by_side(calls.act, ["surroundings"], InThisProcess()) == [(1, "1")]
    assert (os.environ.copy(), sys.path) == before


def test_a_pool_that_breaks_is_replaced_and_all_calls_end(calls, tmp_path):
    """One worker is killed; calls that it had not begun are lost with it, and each is called again."""
    items = [(str(tmp_path / "killed"), number) for number in range(8)]
    reports = []
    with pool() as executor, pytest.warns(JamlabWarning) as said:
        found = run_side_by_side(calls.die_once, items, executor, report=lambda *step: reports.append(step))
    assert found == list(range(8))
    (text,) = [str(each.message) for each in said]
    assert "ProcessPoolExecutor broke" in text and "2 processes of jamlab go on" in text
    assert said[0].filename == __file__


def test_calls_of_a_pool_that_breaks_are_nobodys_fault(calls):
    with pool(workers=1) as executor, pytest.warns(JamlabWarning), crew(calls.linger, executor) as workers:
        for seconds in (60, 0, 0.1):
            workers.submit(seconds, seconds)
        _, kind, (process,) = workers.wait()
        assert kind == "report"  # while the call runs
        os.kill(process, signal.SIGKILL)
        found = ends(workers, 3)
    assert found[0.1] == ("result", 0.1)  # the pool of one knows two calls at a time
    assert [(found[key][0], found[key][1].alone) for key in (60, 0)] == [("death", False)] * 2


def test_reports_come_while_a_call_runs(calls):
    with pool() as executor, crew(calls.linger, executor) as workers:
        workers.submit("long", 1.0)
        began = time.monotonic()
        assert workers.wait()[1] == "report"
        told = time.monotonic()
        assert workers.wait()[1:] == ("result", 1.0)
        assert time.monotonic() - told > 0.5 and told > began


def test_a_call_may_start_processes_of_its_own(calls):
    with pool(workers=1) as executor:
        assert run_side_by_side(calls.act, ["nested"], executor) == [[1, 2]]


class Broken(Executor):
    """Breaks at the first call."""

    def submit(self, function, /, *arguments):
        future = Future()
        future.set_exception(BrokenExecutor("the manager left. Ask your administrator."))
        return future


class Shut(Executor):
    def submit(self, function, /, *arguments):
        raise OSError("no connection")


@pytest.mark.parametrize(
    ("executor", "said"),
    [
        (Broken(), "Broken broke (BrokenExecutor: the manager left): start another one"),
        (Shut(), "Shut takes no calls (OSError: no connection): give one that is open"),
        (ThreadPoolExecutor(2), "ThreadPoolExecutor has 2 threads: LAMMPS cannot"),
    ],
)
def test_executors_that_cannot_be_used_are_named(calls, executor, said):
    with pytest.raises(EngineError) as caught:
        run_side_by_side(calls.act, [1], executor)
    assert str(caught.value).startswith(said)


def test_a_pool_that_is_shut_down_takes_no_calls(calls):
    executor = pool()
    executor.shutdown()
    with pytest.raises(EngineError, match=r"ProcessPoolExecutor takes no calls .*shutdown"):
        run_side_by_side(calls.act, [1], executor)


def test_a_worker_that_runs_calls_in_threads_is_refused(calls):
    """However it hides them: the second call at once is an error, and names the remedy."""

    class Threads(Executor):
        def submit(self, function, /, *arguments):
            future = Future()
            threading.Thread(target=lambda: future.set_result(function(*arguments))).start()
            return future

    with crew(calls.linger, Threads()) as workers:
        for key in range(2):
            workers.submit(key, 0.2)
        kinds = list(ends(workers, 2).values())
    assert sorted(kind for kind, _ in kinds) == ["error", "result"]
    assert "one thread" in str(next(content for kind, content in kinds if kind == "error"))


class Waiting(Executor):
    """Keeps calls for ever, as a queue of a cluster may."""

    def __init__(self):
        self.futures = []

    def submit(self, function, /, *arguments):
        self.futures.append(Future())
        return self.futures[-1]


def test_what_others_cancel_is_called_again_and_an_interruption_cancels_all(calls):
    executor = Waiting()

    def cancel_some():
        while len(executor.futures) < 3:
            time.sleep(0.01)
        executor.futures[1].cancel()
        while len(executor.futures) < 4:
            time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=cancel_some)
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        run_side_by_side(calls.act, [0, 1, 2], executor)
    thread.join()
    assert len(executor.futures) == 4 and all(future.cancelled() for future in executor.futures)


def test_calls_that_are_cancelled_again_and_again_end_the_run(calls):
    class Cancelling(Executor):
        count = 0

        def submit(self, function, /, *arguments):
            future = Future()
            future.cancel()
            future.set_running_or_notify_cancel()
            Cancelling.count += 1
            return future

    with pytest.raises(EngineError, match="Cancelled"):
        run_side_by_side(calls.act, [1], Cancelling())
    assert Cancelling.count == 6


def test_a_function_that_no_worker_can_be_sent_is_named(calls, monkeypatch):
    monkeypatch.delitem(sys.modules, "cloudpickle", raising=False)
    with pytest.raises(InputError, match="function cannot be sent"):
        run_side_by_side(lambda item, report: item, [1], InThisProcess())


def test_a_letterbox_takes_whole_letters_of_this_machine_only():
    """Not those whose writer was killed in the middle, nor those for another file of that number."""
    box = Letterbox()
    letters = [("a", b"x" * 100_000), ("b", b"")]
    with Sender(box.address) as one, Sender(box.address) as other:
        assert one.send(letters[0]) and other.send(letters[1])
        assert box.take() == letters and box.take() == []
        torn = pickle.dumps(letters[0])[:50]
        os.pwrite(one._file, torn, os.fstat(one._file).st_size)  # and the end of the whole is not moved
        assert other.send(letters[1]) and one.send(letters[0])
        assert box.take() == letters[::-1]
    with Sender(box.address._replace(secret=bytes(16))) as stranger:
        assert not stranger.send("letter")
    box.close()
    with Sender(box.address) as late:
        assert not late.send("letter")


def test_reports_of_another_machine_come_at_the_end(calls, monkeypatch):
    monkeypatch.setattr(module.Sender, "send", lambda self, letter: False)
    reports = []
    run_side_by_side(calls.act, [1, 2], InThisProcess(), report=lambda *step: reports.append(step))
    assert reports == [(1, 1, "begun"), (2, 2, "begun")]


def results(packings, where, path=None):
    """Numbers, as bytes, of all that takes processes."""
    measured = jamlab.measure(packings, workers=where)
    how = {"strain": 1.0, "discard": 0.2, "path": path}
    curve = jamlab.flow_curve(packings[0], [0.3, 1.0], workers=where, **how)
    made = jamlab.estimate("rho_J", None, error=0.03, workers=where)
    arrays = [*measured.values(), curve.stress, *(p.positions for p in curve.packings), made.values, made.seeds]
    return b"".join(np.ascontiguousarray(each).tobytes() for each in arrays)


@pytest.fixture(scope="module")
def packings():
    return [jamlab.pack(n=16, pressure=1e-2, seed=seed) for seed in range(3)]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # of Dask: ports and sockets
@pytest.mark.parametrize(
    "engine",
    [
        lambda folder: contextlib.nullcontext(2),
        lambda folder: pool("spawn"),
        lambda folder: pool("forkserver"),
        lambda folder: loky(),
        lambda folder: local_dask(),
        running_dask,
    ],
    ids=["own", "spawn", "forkserver", "loky", "local_dask", "running_dask"],
)
def test_numbers_are_the_same_on_every_engine(packings, tmp_path, engine):
    with engine(tmp_path) as where:
        assert results(packings, where) == results(packings, 1)


@pytest.mark.filterwarnings("ignore")
def test_dask_runs_calls_and_tells_of_its_threads(calls, packings):
    """A worker in a thread of this process, which saves the seconds that new ones take."""
    pytest.importorskip("distributed")
    with local_dask(n_workers=1, processes=False) as executor:
        reports = []
        assert run_side_by_side(calls.act, range(3), executor, report=lambda *step: reports.append(step)) == [0, 1, 2]
        assert sorted(reports) == [(k, k, "begun") for k in range(3)]
        quantities = ["rho", "z", "g"]
        there, here = (jamlab.measure(packings, quantities, workers=where) for where in (executor, None))
        assert all(there[name].tobytes() == here[name].tobytes() for name in quantities)
        with crew(calls.act, executor) as workers:
            assert workers.workers == 1
        with pytest.raises(jamlab.InputError, match=r"get_executor\(pure=False\)"):
            jamlab.measure(packings, workers=executor._client)
        executor.shutdown()
        with pytest.raises(EngineError, match="ClientExecutor takes no calls"):
            run_side_by_side(calls.act, [1], executor)
    with local_dask(n_workers=1, threads_per_worker=2, processes=False) as executor:
        with pytest.raises(EngineError, match="2 threads"):
            run_side_by_side(calls.act, [1], executor)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_dask_names_a_worker_that_died_and_its_limit_of_memory(calls, tmp_path):
    (tmp_path / "hungry.py").write_text(
        "import time\n\ndef eat(item, report):\n    x = b'x' * item\n    time.sleep(9)\n"
    )
    import hungry

    with local_dask(n_workers=1, memory_limit="400MB") as executor:
        with pytest.raises(EngineError, match=r"out of memory, of which Dask allows a worker 0\.4 GB"):
            run_side_by_side(hungry.eat, [600_000_000], executor)
        with crew(calls.linger, executor) as workers:
            workers.submit("killed", 60)
            _, _, (process,) = workers.wait()
            os.kill(process, signal.SIGKILL)
            assert workers.wait() == ("killed", "death", Death(60, "its Dask worker died", True, None))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("engine", [pool, loky, local_dask])
def test_an_interruption_leaves_no_call_waiting(calls, engine):
    """The owner of the executor waits for calls that run, and for no other."""
    with engine() as executor:
        threading.Timer(1.5, os.kill, (os.getpid(), signal.SIGINT)).start()
        with pytest.raises(KeyboardInterrupt), crew(calls.linger, executor) as workers:
            for key in range(100):
                workers.submit(key, 2.0)
            ends(workers, 100)
        began = time.monotonic()
    assert time.monotonic() - began < 20 and not [p for p in psutil.Process().children() if p.name() == "dask"]


class ClientExecutor(Executor):
    """Stands for the one of Dask, whose workers come and go: its client, and calls that never end."""

    def __init__(self, cluster=None):
        self._client, self.status, self.cluster, self.threads = self, "running", cluster, {}
        self.scheduler, self.address = self, "tcp://s:1"

    def nthreads(self):
        return self.threads

    def submit(self, function, /, *arguments):
        return Future()


class SpecCluster:
    pass


def test_each_time_that_dask_has_no_workers_the_user_hears_of_it(calls, monkeypatch):
    for name, value in (("_SILENT", 0.05), ("_NEWS", 0.0), ("_LOOK", 0.01)):
        monkeypatch.setattr(module, name, value)
    executor = ClientExecutor()

    def heard(workers):
        with warnings.catch_warnings(record=True) as found:
            warnings.simplefilter("always")
            end = time.monotonic() + 0.5
            while time.monotonic() < end:
                workers._look()
        return [str(each.message) for each in found]

    with OnExecutor(calls.act, executor) as workers:
        workers.submit(1, 1)
        (line,) = heard(workers)  # once
        assert "scheduler tcp://s:1 has had no workers for" in line and "(calls that wait: 1)" in line
        assert "`dask worker tcp://s:1 --nthreads 1`" in line
        executor.threads = {"tcp://a:1": 1}
        assert heard(workers) == []
        executor.threads = {}
        assert len(heard(workers)) == 1  # again
    with OnExecutor(calls.act, ClientExecutor(SpecCluster())) as workers:
        workers.submit(1, 1)
        assert heard(workers) == []  # who looks after the jobs says it


class Mortal(InThisProcess):
    """Each call has a worker of its own; the third one dies."""

    count = 0

    def submit(self, function, /, *arguments):
        self.count += 1
        future = Future()
        if self.count == 3:
            future.set_exception(RuntimeError("gone"))
        else:
            future.set_result(super().submit(function, *arguments).result()._replace(worker=("host", self.count)))
        return future


def test_workers_that_died_are_not_counted(calls):
    with OnExecutor(calls.act, Mortal()) as workers:
        known = []
        for item in range(4):
            workers.submit(item, item)
            ends(workers, 1)
            known.append(workers.workers)
    assert known == [1, 2, 1, 1]
