"""Signals to a command that draws: one line, no process left, no file in part."""

import os
import signal
import subprocess
import sys
import time

import psutil
import pytest

from jamlab.processes.cores import available_cores


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_no_process_that_draws_is_left(tmp_path, number):
    line = [sys.executable, "-m", "studies", "draw", "papers", "--out", "out"]
    checkout = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    process = subprocess.Popen(
        line,
        cwd=tmp_path,
        text=True,
        start_new_session=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=checkout,
    )
    while not list(tmp_path.glob("out/*.csv")):
        assert process.poll() is None
        time.sleep(0.05)
    children = psutil.Process(process.pid).children()
    assert children or available_cores() == 1
    (os.kill if number == signal.SIGKILL else os.killpg)(process.pid, number)
    _, err = process.communicate(timeout=10)
    assert not psutil.wait_procs(children, timeout=10)[1]
    assert not [path for path in tmp_path.rglob("*.tmp")]
    if number != signal.SIGKILL:
        assert process.returncode == 128 + number
        assert "complete" in err.splitlines()[-1] and "Traceback" not in err
