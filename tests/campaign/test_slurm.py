"""Jobs of SLURM that end, are refused, lost and requeued: every call is carried to its end once, or given up."""

import random
from collections import Counter

import pytest
from commands import call

from jamlab.campaign import slurm
from jamlab.campaign.slurm import SlurmCrew, job_script
from jamlab.errors import EngineError, InputError

distributed = pytest.importorskip("distributed")
pytest.importorskip("dask_jobqueue")


class Future:
    def __init__(self):
        self.status, self.value, self.told, self.gone = "pending", None, [], False

    def add_done_callback(self, function):
        self.told.append(function)

    def end(self, status, value):
        self.status, self.value = status, value
        for function in self.told:
            function(self)

    def result(self, timeout=None):
        if self.gone:
            raise TimeoutError  # Dask waits for a worker that holds a result, and died
        return self.value

    def exception(self):
        return self.value

    def release(self):
        self.status = "cancelled"


class Cluster:
    """SLURM and a Dask client in one, whose clock ticks when it is read: jobs of some lifetime, calls of some length.
    `faults`: job number -> "refuse", "lose", "requeue", "quiet": its end is seen by its absence alone, "forget": it
    ends before what its first call returned is fetched, or "hang": its worker ends, but SLURM lists it as running."""

    def __init__(self, monkeypatch, lifetime, faults=None, starts=True):
        self.time, self.lifetime, self.faults, self.starts = 0.0, lifetime, faults or {}, starts
        self.jobs, self.sent, self.ends, self.carried = {}, 0, 0, Counter()
        self.cancelled = []
        monkeypatch.setattr(slurm, "_run", self.run)
        monkeypatch.setattr(slurm, "_run_script", lambda words, script: self.sbatch(script))
        monkeypatch.setattr(slurm.time, "monotonic", self.tick)
        monkeypatch.setattr(slurm, "_PAUSE", 1e-3)

    def sbatch(self, name):
        self.sent += 1
        fault = self.faults.get(self.sent)
        if fault == "refuse":
            return 1, "QOSMaxSubmitJobPerUserLimit"
        if fault != "lose":
            self.jobs[name] = {
                "id": str(self.sent),
                "fault": fault,
                "age": -3,
                "call": None,
                "again": fault == "requeue",
                "sent": self.time,
            }
        return 0, f"Submitted batch job {self.sent}"

    def run(self, words, joined=True):
        if words[0] == "scancel":
            self.jobs = {name: job for name, job in self.jobs.items() if job["id"] not in words}
            self.cancelled += words[1:]
            return 0, ""
        return 0, "".join(f"{job['id']} {'PD' if job['age'] < 0 else 'R'}\n" for job in self.jobs.values())

    def tick(self):
        self.time += 1.0
        for name, job in list(self.jobs.items()):
            job["age"] += self.starts
            if job["call"] is not None:
                future, left, value = job["call"]
                job["call"] = future, left - 1, value
                if left <= 1:
                    job["call"] = None
                    self.carried[value] += 1
                    future.gone = job["fault"] == "forget"
                    future.end(("lost" if future.gone and value % 2 else "finished"), value)
                    job["age"] += self.lifetime * future.gone
            if job["age"] >= self.lifetime and job["fault"] != "ended":
                self.end(name, job)
        return self.time

    def end(self, name, job):
        self.ends += 1
        future = job["call"][0] if job["call"] else None
        if job["again"]:
            job |= {"again": False, "age": -3, "call": None}
        elif job["fault"] == "hang":
            job |= {"fault": "ended", "call": None}
        else:
            del self.jobs[name]
        if future is not None and job["fault"] != "quiet":
            future.end("error", distributed.scheduler.KilledWorker("a", None, 0))

    def scheduler_info(self, n_workers):
        there = [name for name, job in self.jobs.items() if job["age"] >= 0 and job["fault"] != "ended"]
        return {"workers": {f"tls://{name}": {"name": name} for name in there}}

    def submit(self, length, value, *, key, workers, **_):
        future, (address,) = Future(), workers
        job = self.jobs.get(address.removeprefix("tls://"))
        if job is not None and job["age"] >= 0:  # else it waits for ever, as Dask has it
            assert job["call"] is None
            job["call"] = future, length, value
        return future


def carry_all(crew, lengths):
    for k, length in enumerate(lengths):
        crew.submit(f"c{k}", (length, k))
    return [crew.wait() for _ in lengths]


def ignored(crew_and_calls):
    with pytest.warns(UserWarning):
        return carry_all(*crew_and_calls)


@pytest.mark.parametrize("seed", range(4))
def test_calls_are_carried_once_through_ends_refusals_losses_and_requeues(monkeypatch, seed):
    """200 calls of up to 0.9 of the lifetime of a job, by five jobs at a time, with a fault in every third."""
    rng = random.Random(seed)
    faults = {
        k: rng.choice(["refuse", "lose", "requeue", "quiet", "forget", "hang"])
        for k in range(1, 900)
        if rng.random() < 0.3
    }
    cluster = Cluster(monkeypatch, 40, faults)
    crew = SlurmCrew(cluster, 5, lambda name: name, "00:01:00")
    found = ignored((crew, [rng.randint(1, 36) for _ in range(200)]))
    assert sorted(found) == sorted((f"c{k}", k) for k in range(200))
    assert cluster.ends > 40 and cluster.carried.keys() == set(range(200))
    crew.cancel()
    assert not cluster.jobs


def test_a_call_longer_than_a_job_is_given_up_and_others_are_not(monkeypatch):
    cluster = Cluster(monkeypatch, 40)
    crew = SlurmCrew(cluster, 2, lambda name: name, "00:01:00")
    found = dict(ignored((crew, [5] * 10 + [41] + [5] * 10)))
    assert found.pop("c10") is None and set(found.values()) == {*range(10), *range(11, 21)}
    assert "00:01:00" in crew.cause and cluster.sent < 15


def test_a_requeued_job_is_kept_and_one_that_hangs_is_cancelled(monkeypatch):
    requeued = Cluster(monkeypatch, 40, {1: "requeue"})
    assert len(carry_all(SlurmCrew(requeued, 1, lambda name: name, "1"), [30, 30])) == 2
    assert requeued.sent == 1 and not requeued.cancelled
    hung = Cluster(monkeypatch, 40, {1: "hang"})
    assert len(ignored((SlurmCrew(hung, 1, lambda name: name, "1"), [30, 30]))) == 2
    assert hung.sent == 2 and hung.cancelled == ["1"]


def test_jobs_that_never_begin_and_jobs_that_are_all_refused_end_the_run(monkeypatch):
    lost = Cluster(monkeypatch, 40, dict.fromkeys(range(1000), "lose"))
    with pytest.raises(EngineError):
        ignored((SlurmCrew(lost, 2, lambda name: name, "1"), [1]))
    assert lost.sent <= 2 * slurm._MOST_STILL
    refused = Cluster(monkeypatch, 40, dict.fromkeys(range(1000), "refuse"))
    with pytest.warns(UserWarning), pytest.raises(EngineError) as caught:
        carry_all(SlurmCrew(refused, 2, lambda name: name, "1"), [1])
    assert "QOSMaxSubmitJobPerUserLimit" in str(caught.value)
    assert refused.sent == 1 + len(slurm._RETRIES) and refused.time > sum(slurm._RETRIES)


def test_jobs_that_wait_in_the_queue_are_waited_for(monkeypatch):
    cluster = Cluster(monkeypatch, 40, starts=False)
    crew = SlurmCrew(cluster, 2, lambda name: name, "1")
    crew.submit("a", (1, 1))
    for _ in range(200):
        crew._watch()
    assert cluster.sent == 1 and cluster.time > 5 * slurm._LOOK
    cluster.starts = True
    assert crew.wait() == ("a", 1)


FILE = """
name = "c"
[[sweep]]
name = "disks"
model = "sp"
n = 8
seeds = 4
onset = true
observables = ["slow:slow"]

[slurm]
queue = "short"
walltime = "00:01:00"
"""


def test_dry_run_prints_the_script_and_runs_nothing(tmp_path):
    (tmp_path / "c.toml").write_text(FILE.replace("onset = true", "pressures = [1e-2]\nranks = 3"))
    (tmp_path / "slow.py").write_text("def slow(packing):\n    return 1.0\n")
    done = call(tmp_path, "campaign", "run", "c.toml", "--slurm", "--workers", "9", "--dry-run")
    assert done.exit_code == 0 and not (tmp_path / "c").exists()
    for line in ("#!", "#SBATCH -J c", "#SBATCH -p short", "#SBATCH --cpus-per-task=3", "#SBATCH -t 00:01:00"):
        assert f"\n{line}" in f"\n{done.stdout}"
    assert "--nthreads 1" in done.stdout and "--no-nanny" in done.stdout
    assert "4 jobs of 3 cores" in done.stderr
    with pytest.raises(InputError):
        job_script({"memory": "much"}, 1)
