"""Jobs of a batch system, simulated: what is sent, replaced and cancelled when, and what ends a run."""

import asyncio

import pytest

from jamlab.clusters.batch_jobs import BatchJobs
from jamlab.clusters.batch_system import SYSTEMS, check_cores, list_command, listed_jobs, walltime_seconds
from jamlab.errors import InputError

REFUSAL = "Command exited with non-zero exit code.\nExit code: 1\nCommand:\nsbatch x\nstdout:\n\nstderr:\nno: limit\n\n"


class Queue:
    """A batch system, with the interface of jobs of dask_jobqueue; time passes by one second a look."""

    def __init__(self, most=2, tasks=100, workers=1):
        self.time, self.tasks, self.open, self.answers = 1000.0, tasks, True, True
        self.listed, self.workers, self.sent, self.cancelled, self.said, self.failed = {}, {}, [], [], [], []
        self.kept = BatchJobs(most, workers, self.make, lambda: self.workers, lambda: self.tasks, self.ask,
                              self.said.append, self.failed.append, "squeue")  # fmt: skip

    def make(self, name):
        queue = self

        class Handle:
            job_id = None

            async def start(self):
                if not queue.open:
                    raise RuntimeError(REFUSAL)
                self.job_id = f"{len(queue.sent) + 1}.head"
                queue.listed[str(len(queue.sent) + 1)] = name
                queue.sent.append(name)

            async def close(self):
                queue.cancelled.append(name)

        return Handle()

    async def ask(self):
        return "".join(f" {number}.head x\n" for number in self.listed) if self.answers else None

    def pass_time(self, seconds):
        async def look():
            for _ in range(seconds):
                self.time += 1.0
                await self.kept._look(self.time)

        asyncio.run(look())

    def begin(self, name, busy=True):
        self.workers[f"{name}-0-1"] = busy

    def end(self, name):
        self.workers = {worker: busy for worker, busy in self.workers.items() if not worker.startswith(f"{name}-")}
        self.listed = {number: other for number, other in self.listed.items() if other != name}


def test_no_more_jobs_than_allowed_or_than_tasks():
    queue = Queue(most=3)
    queue.pass_time(3)
    assert queue.sent == ["jamlab-1", "jamlab-2", "jamlab-3"]
    several = Queue(most=9, tasks=5, workers=2)
    several.pass_time(3)
    assert len(several.sent) == 3
    none = Queue(tasks=0)
    none.pass_time(100)
    assert none.sent == none.said == []


def test_a_job_that_ends_is_replaced():
    """Those of its walltime, too."""
    queue = Queue()
    queue.pass_time(1)
    for name in queue.sent:
        queue.begin(name)
    queue.pass_time(30)
    queue.end("jamlab-1")
    queue.pass_time(8)
    assert queue.sent == ["jamlab-1", "jamlab-2", "jamlab-3"] and queue.said == queue.failed == []


def test_a_job_whose_worker_starts_again_is_kept():
    """The batch system says that it runs."""
    queue = Queue(most=1)
    queue.pass_time(1)
    queue.begin("jamlab-1")
    queue.pass_time(5)
    queue.workers.clear()
    queue.pass_time(20)
    queue.begin("jamlab-1")
    queue.pass_time(100)
    assert queue.sent == ["jamlab-1"] and queue.cancelled == []


@pytest.mark.parametrize("answers", [True, False])
def test_a_job_without_workers_is_given_up_after_a_minute(answers):
    """If it hangs, or the batch system cannot be asked."""
    queue = Queue(most=1)
    queue.pass_time(1)
    queue.begin("jamlab-1")
    queue.pass_time(5)
    queue.workers.clear()
    queue.answers = answers
    queue.pass_time(80)
    assert queue.cancelled == ["jamlab-1"] and queue.sent == ["jamlab-1", "jamlab-2"]


def test_a_job_that_vanishes_from_the_queue_is_replaced():
    queue = Queue(most=1)
    queue.pass_time(10)
    queue.end("jamlab-1")
    queue.pass_time(40)
    assert queue.sent == ["jamlab-1", "jamlab-2"] and "job 1 ended before its workers" in queue.said[0]


def test_jobs_wait_for_days_and_the_user_hears_of_it():
    queue = Queue()
    queue.pass_time(70)
    (line,) = queue.said
    assert "no worker for 60 s: 2 jobs wait in the queue" in line and "`squeue` lists them" in line
    queue.pass_time(3000)
    assert len(queue.sent) == 2 and len(queue.said) == 1 and not queue.failed
    queue.begin("jamlab-1")
    queue.pass_time(100)
    assert len(queue.said) == 1
    queue.end("jamlab-1")
    queue.pass_time(100)
    assert len(queue.said) == 2  # it happened again


def test_jobs_that_end_before_they_begin_end_the_run():
    queue = Queue(most=1)
    for _ in range(12):
        queue.pass_time(40)
        queue.listed.clear()
    assert queue.failed and "6 jobs in a row ended before their workers reached the scheduler" in queue.failed[0]


def test_a_batch_system_that_refuses_all_jobs_ends_the_run():
    """With what it says, after half a minute."""
    queue = Queue()
    queue.open = False
    queue.pass_time(25)
    assert not queue.failed and queue.said == ["no: limit; no job is there, and it is asked again from time to time"]
    queue.pass_time(20)
    assert queue.failed[0] == "no: limit"


def test_a_limit_of_jobs_is_no_failure():
    """It may be lifted, and it does not count when the jobs that are there have ended."""
    queue = Queue(most=3)
    queue.pass_time(1)
    for name in queue.sent[1:]:
        queue.end(name)
    queue.begin("jamlab-1")
    queue.open = False
    queue.pass_time(1000)
    assert len(queue.sent) == 3 and not queue.failed and "1 jobs are there" in queue.said[-1]
    queue.end("jamlab-1")
    queue.pass_time(20)
    assert not queue.failed
    queue.open = True
    queue.pass_time(20)
    assert len(queue.sent) == 6


def test_jobs_that_are_not_needed_are_cancelled():
    """Those that wait, and those that have had nothing to do for a minute; not the one with the last task."""
    queue = Queue(most=3)
    queue.pass_time(1)
    queue.begin("jamlab-1")
    queue.begin("jamlab-2", busy=False)
    queue.tasks = 1
    queue.pass_time(50)
    assert queue.cancelled == []
    queue.pass_time(30)
    assert sorted(queue.cancelled) == ["jamlab-2", "jamlab-3"]
    queue.pass_time(500)
    assert len(queue.sent) == 3


def test_the_end_of_a_run_cancels_jobs_also_those_that_are_being_sent():
    queue = Queue(most=2)
    queue.pass_time(1)
    slow = queue.kept.make

    async def end():
        release = asyncio.Event()

        def make(name):
            handle, start = slow(name), None
            start = handle.start

            async def late():
                await release.wait()
                await start()

            handle.start = late
            return handle

        queue.kept.make, queue.kept.most = make, 3
        looking = asyncio.create_task(queue.kept._look(queue.time + 1))
        await asyncio.sleep(0)
        await queue.kept.stop()
        release.set()
        await looking

    asyncio.run(end())
    assert sorted(queue.cancelled) == sorted(queue.sent) == ["jamlab-1", "jamlab-2", "jamlab-3"]


def test_what_goes_wrong_inside_ends_the_run():
    """A run whose jobs nobody keeps would wait for ever."""
    queue = Queue()
    queue.kept.tasks = lambda: 1 / 0
    asyncio.run(queue.kept.keep())
    assert "ZeroDivisionError" in queue.failed[0]


@pytest.mark.parametrize(
    ("system", "walltime", "seconds"),
    [
        ("slurm", "90", 5400),
        ("slurm", "90:30", 5430),
        ("slurm", "01:30:00", 5400),
        ("slurm", "2-12", 216_000),
        ("slurm", "1-00:00:30", 86_430),
        ("pbs", "90", 90),
        ("pbs", "02:00:00", 7200),
        ("moab", "1:00:00:00", 86_400),
        ("sge", "00:30:00", 1800),
        ("lsf", "00:30", 1800),
        ("lsf", "90", 5400),
        ("oar", "2", 7200),
        ("oar", "00:30:00", 1800),
        ("htcondor", None, None),
    ],
)
def test_walltimes_are_read_as_each_system_reads_them(system, walltime, seconds):
    assert walltime_seconds(system, walltime) == seconds


@pytest.mark.parametrize("walltime", [43_200, "soon", "1:2:3:4", "-1", "1-", ""])
def test_walltimes_that_cannot_be_name_file_and_key(walltime):
    with pytest.raises(InputError, match=r"jobqueue.slurm.walltime = .* in ~/.config/dask/jobqueue.yaml"):
        walltime_seconds("slurm", walltime)


@pytest.mark.parametrize(
    ("system", "settings", "right"),
    [
        ("slurm", {}, True),
        ("slurm", {"job-cpu": 2}, False),
        ("slurm", {"job-cpu": 8}, True),
        ("pbs", {"resource-spec": "select=1:ncpus=2:mem=2GB"}, False),
        ("pbs", {"resource-spec": "select=1:ncpus=4:mem=2GB"}, True),
        ("moab", {"resource-spec": "nodes=1:ppn=1"}, False),
        ("lsf", {"ncpus": 1}, False),
        ("oar", {"resource-spec": "/nodes=1/core=2"}, False),
        ("sge", {}, False),
        ("sge", {"job-extra-directives": ["-V", "-pe smp 2"]}, False),
        ("sge", {"job-extra-directives": ["-pe smp 4"]}, True),
        ("htcondor", {}, True),
    ],
)
def test_settings_that_book_too_few_cores_are_refused(system, settings, right):
    if right:
        check_cores(system, settings, 4)
    else:
        with pytest.raises(InputError, match=rf"needs 4 cores, and jobqueue.{system}\."):
            check_cores(system, settings, 4)
    check_cores("sge", {}, 1)


def test_numbers_of_jobs_are_read_from_what_each_system_lists():
    assert listed_jobs("12\n13\n") == {"12", "13"} and listed_jobs("") == set()
    assert listed_jobs("1234.head.cluster\n77[].head\n") == {"1234", "77"}
    heading = "job-ID  prior   name       user         state\n" + "-" * 40 + "\n"
    assert listed_jobs(heading + "  41 0.5 jamlab  me  r  08/01/2026 queue@node12  4\n") == {"41"}
    assert all("{" not in word for system in SYSTEMS for word in list_command(system))
