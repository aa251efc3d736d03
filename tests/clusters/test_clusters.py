"""Workers of a Dask scheduler, or of jobs of a batch system: scripts of jobs, keys, settings, and what ends badly."""

import importlib.metadata
import json
import os
import re
import signal
import socket
import stat
import subprocess
import sys
import time
from pathlib import Path

import pytest
from fake_batch import FakeBatch

import jamlab
from jamlab.clusters import batch_worker
from jamlab.clusters.batch_system import SYSTEMS
from jamlab.clusters.keys import key_folder, write_key
from jamlab.errors import InputError
from jamlab.storage.held_folder import remove_if_abandoned

SWEEP = '[[sweep]]\nname = "disks"\nmodel = "sp"\nn = 8\nseeds = 6\npressures = [1e-2]\n'
SLOW = 'observables = ["sleeper:sleep"]\n'
SLEEPER = "import ctypes\n\n\ndef sleep(packing):\n    ctypes.CDLL(None).sleep(20)\n    return 1.0\n"


@pytest.fixture
def campaign(tmp_path):
    (tmp_path / "small.toml").write_text(f'name = "small"\n{SWEEP}ranks = 2\n')
    return jamlab.open_campaign(tmp_path / "small.toml")


@pytest.fixture
def site(tmp_path, monkeypatch):
    """Set keys of jobqueue.yaml."""
    monkeypatch.setenv("DASK_CONFIG", str(tmp_path))  # before Dask is imported, which would write to HOME
    dask = pytest.importorskip("dask")
    from jamlab.clusters.cluster import _dask

    _dask("slurm")

    def fill(system, **settings):
        named = {key.replace("_", "-"): value for key, value in settings.items()}
        return dask.config.set({f"jobqueue.{system}.{key}": value for key, value in named.items()})

    return fill


CORES = {
    "slurm": "--cpus-per-task=2\n",
    "pbs": "select=1:ncpus=2:",
    "moab": "select=1:ncpus=2:",
    "lsf": "#BSUB -n 2\n",
    "oar": "/nodes=1/core=2,",
    "sge": "-pe smp 2\n",
    "htcondor": "MY.DaskWorkerCores = 2\n",
}


@pytest.mark.parametrize("system", sorted(SYSTEMS))
def test_scripts_of_jobs_book_the_cores_of_a_task_for_a_worker_of_one_thread(system, site, campaign):
    """On each system; when the job ends stands in it where the system has a walltime. Nothing is written."""
    more = {"sge": {"job_extra_directives": ["-pe smp 2"]}, "htcondor": {"disk": "1GB"}}.get(system, {})
    more |= {"oar": {"memory_per_core_property_name": "not_applicable"}}.get(system, {})
    with site(system, memory="1GB", **more):
        script = campaign.job_script(system)
    assert CORES[system] in script and re.search(r"export OMP_NUM_THREADS=1\b", script)
    (line,) = (line for line in script.splitlines() if "batch_worker" in line)
    assert re.search(r" -P -m jamlab.clusters.batch_worker 1 tls://ADDRESS:PORT --name jamlab-1 ", line)
    assert re.findall(r"--nthreads (\d)", line)[-1] == "1" and "--no-nanny" in line and "keys.XXXXXXXX" in line
    assert (re.findall(r"JAMLAB_JOB_ENDS=\$\(\(\$\(date \+%s\) \+ (\d+)\)\)", script) == ["1800"]) == (
        system != "htcondor"
    )
    assert not campaign.folder.path.exists()


def test_a_script_says_that_its_walltime_is_the_one_of_dask(site, campaign):
    said = "# a job ends after 00:30:00, as Dask has it: set jobqueue.slurm.walltime in ~/.config/dask/jobqueue.yaml"
    with site("slurm", memory="1GB"):
        assert said in campaign.job_script("slurm").splitlines()
    with site("slurm", memory="1GB", walltime="04:00:00"):
        script = campaign.job_script("slurm")
    assert "+ 14400))" in script and "as Dask has it" not in script


def test_a_job_of_a_whole_node_has_a_worker_for_every_task_that_it_holds(site, campaign):
    with site("slurm", memory="64GB", cores=32):
        script = campaign.job_script("slurm")
    assert "batch_worker 16 tls" in script and "--cpus-per-task=32" in script and "--memory-limit 3.73GiB" in script


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({}, r"set jobqueue.slurm.memory in ~/.config/dask/jobqueue.yaml"),
        ({"memory": "1GB", "cores": 1}, r"jobqueue.slurm.cores in .* = 1: a task has ranks = 2: book as many"),
        ({"memory": "1GB", "walltime": 43_200}, "write it in quotes"),
        ({"memory": "much"}, r"jobqueue.slurm in .*much"),
    ],
)
def test_settings_of_a_site_that_cannot_be_name_file_and_key(site, campaign, settings, words):
    with site("slurm", **settings), pytest.raises(InputError, match=words):
        campaign.job_script("slurm")


def test_only_batch_systems_have_a_script(site, campaign):
    with pytest.raises(InputError, match="scheduler = tcp://a:1: only batch systems"):
        campaign.job_script("tcp://a:1")


@pytest.mark.parametrize(
    ("where", "jobs", "words"),
    [
        ("slurm", None, "jobs = None: give the largest number of jobs of slurm"),
        ("slurm", 0, "jobs = 0"),
        ("tcp://127.0.0.1:1", 2, "jobs = 2: the scheduler tcp://127.0.0.1:1 has its own workers"),
        ("slrum", None, "'slrum' is no Dask scheduler .*one of htcondor, lsf, moab"),
        ("tls://127.0.0.1:1", None, "wants certificates"),
    ],
)
def test_clusters_that_there_cannot_be_are_refused(site, campaign, where, jobs, words):
    with pytest.raises(InputError, match=words), campaign.cluster(where, jobs):
        pass


def test_a_machine_without_the_batch_system_is_named(site, campaign, monkeypatch):
    monkeypatch.setenv("PATH", "/nowhere")
    with site("slurm", memory="1GB"), pytest.raises(InputError, match="no sbatch on this machine"):
        with campaign.cluster("slurm", 2):
            pass


def test_without_dask_the_extra_is_named(campaign, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"pip install 'jamlab\[dask\]'"), campaign.cluster("tcp://a:1"):
        pass


@pytest.mark.slow
def test_what_dask_takes_as_it_is_imported_is_given_back():
    """SIGINT by dask_jobqueue; and neither jamlab nor its commands import it before it is asked for."""
    program = (
        "import signal, sys; before = signal.getsignal(signal.SIGINT); import jamlab, jamlab.cli.main; "
        "jamlab.open_campaign; import jamlab.clusters.cluster as c; "
        "assert not {'dask', 'distributed', 'dask_jobqueue', 'cryptography'} & set(sys.modules); "
        "c._dask('slurm'); assert 'dask_jobqueue' in sys.modules and signal.getsignal(signal.SIGINT) is before"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


def test_a_signal_during_an_import_comes_after_it():
    from jamlab.clusters.cluster import _signals_later

    done = []
    with pytest.raises(KeyboardInterrupt), _signals_later():
        signal.raise_signal(signal.SIGINT)
        done.append(True)
    assert done and signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_keys_are_the_owners_alone_and_gone_at_the_end(tmp_path):
    with key_folder(tmp_path / "c") as keys:
        write_key(keys / "key", "secret")
        assert stat.S_IMODE(keys.stat().st_mode) == 0o700 and stat.S_IMODE((keys / "key").stat().st_mode) == 0o600
    assert list((tmp_path / "c").iterdir()) == []
    with pytest.raises(ZeroDivisionError), key_folder(tmp_path / "c"):
        raise ZeroDivisionError
    assert list((tmp_path / "c").iterdir()) == []


def test_keys_of_a_run_that_was_killed_are_removed_at_the_next_start_and_no_others(tmp_path):
    program = (
        "import sys, time; from pathlib import Path; from jamlab.clusters.keys import *\n"
        "with key_folder(Path(sys.argv[1])) as keys: write_key(keys / 'key', 'secret'); print(keys, flush=True); "
        "time.sleep(60)"
    )
    runs = [
        subprocess.Popen([sys.executable, "-c", program, str(tmp_path)], stdout=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    killed, alive = (run.stdout.readline().strip() for run in runs)
    runs[0].kill()
    runs[0].wait()
    assert os.path.exists(killed)
    remove_if_abandoned(Path(alive))
    with key_folder(tmp_path) as keys:
        assert not os.path.exists(killed) and os.path.exists(os.path.join(alive, "key"))
        assert {str(path) for path in tmp_path.iterdir()} == {alive, str(keys)}
    runs[1].kill()
    for run in runs:
        run.wait()
        run.stdout.close()


def test_a_job_without_scheduler_removes_keys_only_if_nobody_listens_and_nobody_holds_them(tmp_path, capsys):
    """A scheduler that is out of reach is named, with the key to look at."""

    def end(address, keys):
        before = [signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGINT)]
        batch_worker.main(0, [address, "--name", "a", "--tls-key", str(keys / "key")])
        for number, handler in zip((signal.SIGTERM, signal.SIGINT), before, strict=True):
            signal.signal(number, handler)
        return keys.exists()

    abandoned = tmp_path / "keys.1"
    abandoned.mkdir()
    (abandoned / "owner").touch()
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        assert end(f"tls://127.0.0.1:{port}", abandoned) and capsys.readouterr().err == ""
    assert end("tls://no-such-host.invalid:1", abandoned)
    assert "no-such-host.invalid:1 is out of reach" in (said := capsys.readouterr().err) and "interface" in said
    with key_folder(tmp_path / "c") as held:
        assert end(f"tls://127.0.0.1:{port}", held)
    assert not end(f"tls://127.0.0.1:{port}", abandoned) and capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--jobs", "2"], "--jobs 2 needs --scheduler"),
        (["--dry-run"], "--dry-run needs --scheduler"),
        (["--scheduler", "slurm", "--workers", "2"], "--workers 2 are processes of this machine"),
        (["--scheduler", "slurm"], "--jobs None: give the largest number of jobs"),
    ],
)
def test_options_of_which_one_would_be_ignored_are_refused(run_command, site, campaign, words, said):
    assert said in run_command("campaign", "run", str(campaign.file), *words)


@pytest.fixture
def run_command(capfd, monkeypatch):
    """Run a command that fails; what it says on stderr."""

    def run(*words):
        from jamlab.cli.main import app

        with pytest.raises(SystemExit) as ended:
            app(words)
        assert ended.value.code == 1
        return capfd.readouterr().err

    return run


class Client:
    """A client of Dask whose worker has other versions."""

    def __init__(self, distributed, jamlab_there, nthreads=1):
        self._there, self._jamlab, self._threads = distributed, jamlab_there, nthreads

    def scheduler_info(self, n_workers):
        return {"workers": {"tcp://a:1": {"nthreads": self._threads}}}

    def get_versions(self, check):
        def known(distributed):
            return {"packages": {"python": "3.13.0.final.0", "distributed": distributed}}

        return {
            "client": known("2026.8.0"),
            "scheduler": known(self._there),
            "workers": {"tcp://a:1": known("2026.8.1")},
        }

    def run(self, function, *words, on_error):
        return {"tcp://a:1": self._jamlab}


def test_versions_of_scheduler_and_workers_that_differ_are_named():
    from jamlab.clusters.cluster import _check_workers

    said, here = [], importlib.metadata.version("jamlab")
    _check_workers(Client("2026.8.0", here), "tcp://s:1", said.append)
    assert not said
    _check_workers(Client("2025.1.0", here), "tcp://s:1", said.append)
    assert said == ["distributed is 2026.8.0 here and 2025.1.0 at the scheduler: install the same version"]
    for there, words in (("0.0.1", f"has jamlab 0.0.1, and here is {here}"), (ModuleNotFoundError(), "has no jamlab")):
        with pytest.raises(InputError, match=f"the worker tcp://a:1 {words}"):
            _check_workers(Client("2026.8.0", there), "tcp://s:1", said.append)
    with pytest.raises(InputError, match=r"runs 4 tasks at once in threads.*--nthreads 1 --nworkers 4"):
        _check_workers(Client("2026.8.0", here, nthreads=4), "tcp://s:1", said.append)


# whole runs


@pytest.fixture
def slow(tmp_path):
    """The folder of a campaign of long tasks."""
    (tmp_path / "sleeper.py").write_text(SLEEPER)
    (tmp_path / "slow.toml").write_text(f'name = "slow"\n{SWEEP}{SLOW}')
    return tmp_path


def start(folder, environment, *words):
    line = [sys.executable, "-m", "jamlab", "campaign", "run", "slow.toml", *words]
    return subprocess.Popen(line, cwd=folder, env=environment, stderr=subprocess.PIPE, text=True)


def wait_for(condition, seconds):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.1)


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_no_job_and_no_key_survives_the_end_of_the_driver(slow, number):
    with FakeBatch(slow / "batch", kill_wait=10.0) as batch:
        driver = start(slow, batch.environment(), "--scheduler", "slurm", "--jobs", "2")
        wait_for(lambda: len(list(slow.glob("slow/running/*"))) == 2, 60)
        driver.send_signal(number)
        _, said = driver.communicate(timeout=30)
        wait_for(lambda: not batch.processes(), 30)
        if number == signal.SIGKILL:
            assert not list(slow.glob("slow/keys.*"))  # its workers have removed them
            driver = start(slow, batch.environment(), "--scheduler", "slurm", "--jobs", "2", "--only", "disks")
            wait_for(lambda: len(batch.log("started")) == 4, 60)
            driver.terminate()
            driver.communicate(timeout=30)
        else:
            assert driver.returncode == 128 + number and said.count("\n") == 1 and "0 of 6 tasks are finished" in said
            assert not list(slow.glob("slow/running/*"))
        wait_for(lambda: not batch.processes(), 30)
        assert not list(slow.glob("slow/*keys.*")) and not list(slow.glob("slow/jobs"))
        assert not os.listdir(batch.root / "tmp")


@pytest.mark.slow
def test_a_batch_system_that_refuses_every_job_ends_the_run_with_its_words(slow):
    with FakeBatch(slow / "batch", refuse=1.0) as batch:
        driver = start(slow, batch.environment(), "--scheduler", "slurm", "--jobs", "2")
        _, said = driver.communicate(timeout=120)
    assert driver.returncode == 1 and not list(slow.glob("slow/*keys.*"))
    note, error = said.splitlines()
    assert note.startswith("note: slurm: sbatch: error: QOSMaxSubmitJobPerUserLimit")
    assert error.startswith("error: slurm: sbatch: error: QOSMax") and "jobqueue.slurm in ~/.config" in error


@pytest.fixture
def scheduler(tmp_path):
    """A Dask scheduler of this machine; a function that starts a worker of so many threads; both end with the test."""
    started = []

    def begin(*words):
        line = [sys.executable, "-m", "distributed.cli." + words[0], *words[1:]]
        started.append(subprocess.Popen(line, cwd=tmp_path, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL))
        return started[-1]

    file = tmp_path / "scheduler.json"
    begin("dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(file), "--no-dashboard")
    wait_for(file.exists, 60)
    yield file, lambda threads: begin("dask_worker", "--scheduler-file", str(file), "--nthreads", str(threads))
    for process in reversed(started):
        process.terminate()
    for process in started:
        process.wait(30)


@pytest.mark.slow
def test_campaigns_run_side_by_side_on_a_scheduler_and_leave_dask_as_it_was(scheduler, site, tmp_path, monkeypatch):
    """A scheduler without workers is named, and waited for; workers of several threads are refused."""
    import logging

    import dask

    monkeypatch.setattr("jamlab.clusters.cluster._SILENT", 1.0)
    file, worker = scheduler
    before, level = repr(dask.config.config), logging.getLogger("distributed").level
    campaigns, ran, said = [], [], []
    for name in "ab":
        (tmp_path / f"{name}.toml").write_text(f'name = "{name}"\n{SWEEP}')
        campaigns.append(jamlab.open_campaign(tmp_path / f"{name}.toml"))
    with campaigns[0].cluster(str(file), tell=said.append) as first, campaigns[1].cluster(str(file)) as second:
        runs = [each.start(cluster.executor) for each, cluster in zip(campaigns, (first, second), strict=True)]
        wait_for(lambda: said, 30)
        worker(1)
        ran = [run.wait(120) for run in runs]
    assert [(each.finished, each.failed) for each in ran] == [
        (6, 0),
        (6, 0),
    ] and "has no workers: the run waits" in said[0]
    assert (repr(dask.config.config), logging.getLogger("distributed").level) == (before, level)
    several = worker(2)

    def refused():
        try:
            with campaigns[0].cluster(str(file)):
                return ""
        except InputError as error:
            return str(error)

    wait_for(lambda: "runs 2 tasks at once in threads" in refused(), 60)
    several.terminate()


@pytest.mark.slow
def test_a_worker_that_is_killed_starts_again_in_its_job_which_ends_with_the_last_worker(slow):
    with FakeBatch(slow / "batch") as batch:
        driver = start(slow, batch.environment(), "--scheduler", "slurm", "--jobs", "1")

        def begun(*known):
            marks = [json.loads(path.read_bytes()[:320]) for path in slow.glob("slow/running/*")]
            return [mark["pid"] for mark in marks if mark["pid"] not in known]

        wait_for(begun, 60)
        (first,) = begun()
        os.kill(first, signal.SIGKILL)
        wait_for(lambda: begun(first), 60)
        assert len(batch.log("submitted")) == 1
        driver.kill()
        driver.communicate()
        wait_for(lambda: batch.log("ended"), 30)
