"""Where tasks run: shares, workers that cannot live or are killed; nothing is left behind, all is whole."""

import json
import subprocess
import sys
import time

import psutil
import pytest
from commands import call

import jamlab
from jamlab.campaign import driver
from jamlab.campaign.plan import longest_first, share_names
from jamlab.campaign.tasks import batches, task_names
from jamlab.errors import EngineError, InputError, StorageError
from jamlab.processes.child import child_environment

FILE = """
name = "c"
[[sweep]]
name = "disks"
model = "sp"
n = 8
seeds = 4
onset = true
"""


@pytest.fixture
def campaign(tmp_path):
    (tmp_path / "c.toml").write_text(FILE)
    return jamlab.open_campaign(tmp_path / "c.toml")


@pytest.mark.slow
def test_nobody_can_connect_to_workers_on_this_machine(campaign):
    """They are reached by pipes: no process of the run listens anywhere."""
    older = {p.pid for p in psutil.Process().children(recursive=True)}  # a browser of other tests among them
    seen, heard = set(), set()

    def listening(process):
        return {c.laddr for c in process.net_connections() if c.status == psutil.CONN_LISTEN}

    def listen(share, text):
        run = [p for p in psutil.Process().children(recursive=True) if p.pid not in older]
        seen.update(p.pid for p in run)
        heard.update(*(listening(p) for p in [psutil.Process(), *run]))

    before = listening(psutil.Process())
    assert campaign.run(1, progress=listen).finished == 4
    assert seen and heard <= before


def test_workers_that_die_at_once_end_the_run(campaign, monkeypatch):
    monkeypatch.setattr(driver, "_MOST_UNBEGUN", 2)
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with pytest.raises(EngineError) as caught:
        campaign.run(2)
    assert "exit code 1" in str(caught.value)
    assert campaign.status().left == 4


def test_a_task_that_ends_its_worker_is_recorded_at_once(tmp_path):
    """Others go on: the observable ends the process at one seed only. Progress says that no worker has answered before
    the first does."""
    (tmp_path / "deadly.py").write_text(
        "import os\n\ndef kill(packing):\n    return os._exit(9) if packing.provenance['seed'] == 1 else 1.0\n"
    )
    (tmp_path / "c.toml").write_text(FILE.replace("seeds = 4", "seeds = 2") + 'observables = ["deadly:kill"]\n')
    campaign = jamlab.open_campaign(tmp_path / "c.toml")
    said = []
    done = campaign.run(1, progress=lambda share, text: said.append(text))
    assert (done.finished, done.failed) == (1, 1)
    assert said[0] == "0 of 2 tasks, no worker has answered yet" and "answered" not in said[-1]
    (record,) = campaign.status().failures.values()
    assert record["reason"] == "its worker died with exit code 9: a called function exited"


@pytest.mark.parametrize("share", [(0, 4), (5, 4), (-1, 4), (1, 0)])
def test_shares_that_there_cannot_be(campaign, share):
    with pytest.raises(InputError) as caught:
        campaign.run(1, share=share)
    assert f"{share[0]}/{share[1]}" in str(caught.value) and not campaign.folder.path.exists()


@pytest.mark.parametrize("words", [("--share", "3"), ("--share", "a/4"), ("--share", "5/4"), ("--workers", "0")])
def test_words_that_name_no_share_and_no_workers(campaign, words):
    done = call(campaign.file.parent, "campaign", "run", "c.toml", *words)
    assert done.exit_code == 1 and done.stderr.count("\n") == 1 and words[1] in done.stderr


def test_long_tasks_come_first(tmp_path):
    """Twenty droplets have more vertices than 200 disks have sites."""
    text = FILE.replace("seeds = 4", "seeds = 1")
    other = text.partition("[[sweep]]")[2].replace('"disks"', '"droplets"').replace('"sp"', '"dp"').replace("8", "20")
    (tmp_path / "c.toml").write_text(text.replace("n = 8", "n = [8, 200, 100]") + "[[sweep]]" + other)
    ordered = longest_first(batches(jamlab.open_campaign(tmp_path / "c.toml").content))
    assert [batch.parameters.n for batch in ordered] == [20, 200, 100, 8]


def test_shares_are_disjoint_even_and_of_the_file_alone(campaign, here):
    """Whatever is finished, and whichever sweeps a share is told to run."""
    everything = batches(campaign.content)
    names = [share_names(everything, (k, 3)) for k in (1, 2, 3)]
    assert sorted(map(len, names)) == [1, 1, 2] and set.union(*names) == task_names(everything)
    first = campaign.run(1, share=(2, 3))
    assert (first.finished, first.left) == (1, 3) and campaign.folder.finished() == names[1]
    assert campaign.run(1, pilot=True).finished == 0  # one is finished, though not the first
    assert [campaign.run(1, share=(k, 3)).left for k in (1, 2, 3)] == [1, 1, 0]
    assert share_names(everything, (9, 9)) == set()  # more shares than tasks


def test_shares_of_some_sweeps_are_those_of_all(tmp_path, here):
    """So that a share told to run one sweep has no task in common with the other shares told to run all."""
    more = FILE.partition("[[sweep]]")[2].replace('"disks"', '"more"').replace("n = 8", "n = 6")
    (tmp_path / "c.toml").write_text(FILE.replace("seeds = 4", "seeds = 3") + "[[sweep]]" + more)
    campaign = jamlab.open_campaign(tmp_path / "c.toml")
    share = share_names(batches(campaign.content), (1, 2))
    campaign.run(1, share=(1, 2), only=["more"])
    assert campaign.folder.finished() == share & task_names(batches(campaign.content, ["more"]))


@pytest.mark.slow
def test_shares_run_at_once_in_one_folder(tmp_path):
    """Two processes, one of them killed in the middle; each task is run once, and the rest by the same line again."""
    (tmp_path / "c.toml").write_text(FILE.replace("seeds = 4", "seeds = 10"))

    def start(k):
        line = [sys.executable, "-m", "jamlab.cli", "campaign", "run", "c.toml", "--workers", "1", "--share", f"{k}/2"]
        where = {"cwd": tmp_path, "env": child_environment(), "text": True}
        return subprocess.Popen([*line, "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, **where)

    campaign = jamlab.open_campaign(tmp_path / "c.toml")
    second = share_names(batches(campaign.content), (2, 2))
    processes = [start(k) for k in (1, 2)]
    while campaign.folder.finished().isdisjoint(second):
        assert processes[1].poll() is None
        time.sleep(0.02)
    processes[1].kill()
    outputs = [process.communicate(timeout=120) for process in processes]
    assert [process.returncode for process in processes] == [0, -9], outputs
    assert json.loads(outputs[0][0])["finished"] == 5
    left = campaign.status().left
    assert 1 <= left <= 4 and not campaign.folder.damages(campaign.folder.finished())
    ran = json.loads(start(2).communicate(timeout=120)[0])
    assert ran == {"finished": left, "failed": 0, "repaired": {}, "left": 0, "gaps": []}


def test_runs_that_would_have_tasks_in_common_are_refused(campaign):
    """The same share, another number of shares, a run of all; not another share."""
    folder = campaign.folder
    folder.prepare()
    with folder.lock((1, 4)):
        with folder.lock((2, 4)):
            pass
        for other in ((1, 4), (2, 3), (1, 1)):
            with pytest.raises(StorageError) as caught, folder.lock(other):
                pass
            assert str(folder.path) in str(caught.value) and "lock.1-of-4" in str(caught.value)
    with folder.lock((1, 3)):  # the first again
        pass
