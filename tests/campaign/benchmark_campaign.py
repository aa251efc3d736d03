"""What campaigns cost beside their tasks. pytest -m benchmark -s tests/campaign/benchmark_campaign.py.

Overhead is that of one worker between its first and its last task; the start of the driver and its workers, once per
run, is printed beside it. Ratios on a machine with nothing else to do; as many cores as workers.
"""

import json
import subprocess
import sys
import time

import pytest
from campaigns import compression, read_campaign_file

import jamlab
from jamlab.campaign.tasks import batches


def timed(folder, name, workers, seeds, step=2e-3):
    """Seconds from the first to the last end of a task, of the whole run, and of each task but the first."""
    path = folder / f"{name}.toml"
    compression(path, name, n=32, seeds=seeds, step=step)
    ends, spans = [], []

    def progress(outcome):
        ends.append(time.perf_counter())
        spans.append(outcome.seconds)

    began = time.perf_counter()
    assert jamlab.open_campaign(path).run(workers, done=progress).finished == seeds
    return ends[-1] - ends[0], time.perf_counter() - began, spans[1:]


@pytest.mark.benchmark
def test_overhead_of_tasks_of_a_second(tmp_path):
    between, whole, spans = timed(tmp_path, "one", 1, 12)
    overhead = between / sum(spans) - 1
    row = {"task_s": sum(spans) / len(spans), "overhead": overhead, "start_s": whole - between - spans[0]}
    print(json.dumps(row))
    assert row["task_s"] > 0.5
    assert overhead < 0.02


@pytest.mark.benchmark
def test_status_of_ten_thousand_files(tmp_path):
    path = tmp_path / "many.toml"
    compression(path, "many", n=[16, 32], seeds=5000)
    tasks = tmp_path / "many" / "tasks"
    tasks.mkdir(parents=True)
    for batch in batches(read_campaign_file(path)):
        for name in batch.names():
            (tasks / f"{name}.h5").touch()
    line = [sys.executable, "-m", "jamlab.cli", "campaign", "status", str(path), "--json"]
    began = time.perf_counter()
    done = subprocess.run(line, capture_output=True, text=True, check=True)
    seconds = time.perf_counter() - began
    print(json.dumps({"status_s": seconds}))
    assert json.loads(done.stdout)["finished"] == 10_000
    assert seconds < 2.0
