"""CPU time of `jamlab campaign status` on ten thousand files. pytest -m benchmark -s tests/campaign."""

import json
import resource
import subprocess
import sys

import pytest
from campaigns import compression, read_campaign_file

from jamlab.campaign.tasks import batches


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
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(line, capture_output=True, text=True, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(json.dumps({"status_s": seconds}))
    assert json.loads(done.stdout)["finished"] == 10_000
    assert seconds < 2.0
