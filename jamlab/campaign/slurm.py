"""Jobs of SLURM that carry tasks: sent with sbatch, watched, and replaced when they end before the tasks are done.

A job is one worker of a Dask scheduler, which is part of the driver, and gets one call at a time. So the driver knows
the call during which a job ended, by its walltime or otherwise, and has another job carry it again. If several jobs
ended during the same call, which was the first that each of them got, it needs more than a job has and is given up.

Both sides of every connection show a certificate that is made for the run and kept in files of this user alone.
"""

import contextlib
import logging
import os
import queue
import re
import shutil
import subprocess
import tempfile
import time
import warnings
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jamlab.campaign.folder import CERTIFICATE
from jamlab.errors import EngineError, InputError

if TYPE_CHECKING:
    from distributed import Client
    from distributed.security import Security

_LOOK = 20.0  # s between two looks at the queue; the end of a connected job is noticed at once
_PAUSE = 1.0  # s to wait for the end of a call before jobs are counted again
_FETCH = 10.0  # s to fetch what a call returned, which its worker holds
_REGISTERED = 10.0  # s that a new job may need to appear in the queue
_COMMAND_TIMEOUT = 60.0  # s
_RETRIES = (5.0, 10.0, 20.0, 40.0, 80.0)  # s after each refusal; jobs that run are a reason to go on trying
_DEATH_TIMEOUT = 60  # s without a scheduler after which a job exits; as long as a connection may take
_MOST_ALONE = 3  # jobs that may end at a call which was the first they got
_MOST_DEATHS = 20  # jobs that may end at a call anyhow
_MOST_STILL = 12  # jobs in a row that may end before their worker answered
_DEFAULTS = {"memory": "2 GB", "walltime": "24:00:00"}  # a task needs under 1 GB up to n = 32768
_OF_SCHEDULER = ("host", "interface")
_PENDING = ("PD", "PENDING")

Call = tuple[Any, ...]  # a function and its arguments, all of which can be pickled


def job_script(
    options: dict[str, Any],
    ranks: int,
    name: str = "WORKER",
    address: str = "tls://DRIVER:PORT",
    security: "Security | None" = None,
) -> str:
    """Script of the job of one worker.

    Args:
        options: the table `slurm` of a campaign file.
        name: of the worker.
        address: of the driver.
    """
    try:
        from dask_jobqueue.slurm import SLURMJob
    except ImportError:
        raise InputError("SLURM needs dask-jobqueue: pip install 'jamlab[slurm]'") from None
    given = _DEFAULTS | {key: value for key, value in options.items() if key != "host"}
    # `cores` are threads of the worker, which runs one task; `job_cpu` are those that the job books. Without a nanny,
    # a worker that dies ends its job.
    fixed: dict[str, Any] = {"cores": 1, "processes": 1, "job_cpu": ranks, "nanny": False}
    fixed |= {"death_timeout": _DEATH_TIMEOUT, "protocol": "tls://", "security": security, "name": name}
    for key in fixed.keys() & given.keys():
        raise InputError(
            f"[slurm] {key} = {given[key]!r}: jamlab sets it, leave it out; `ranks` of a sweep books cores"
        )
    try:
        return str(SLURMJob(address, **given, **fixed).job_script())
    except (TypeError, ValueError) as error:
        reason = str(error).partition(". ")[0]
        raise InputError(f"[slurm] {given}: {reason}; keys are those of dask_jobqueue.SLURMCluster") from error


@contextlib.contextmanager
def slurm_crew(options: dict[str, Any], name: str, ranks: int, jobs: int, folder: Path) -> "Iterator[SlurmCrew]":
    """A scheduler in this process, and as many jobs that connect to it; all end with the block."""
    import dask
    from distributed import Client, Scheduler, SpecCluster

    options = {"job_name": name} | options
    if missing := [name for name in ("sbatch", "scancel") if shutil.which(name) is None]:
        raise InputError(
            f"SLURM: no command {' or '.join(missing)}: run --slurm where jobs are submitted, or --workers"
        )
    code, said = _run_script(["sbatch", "--test-only"], job_script(options, ranks))
    if code:  # SLURM says at once what is wrong with a job
        raise InputError(f"SLURM refuses the job: {said}; change [slurm] of the campaign file")
    with contextlib.ExitStack() as stack:
        stack.enter_context(dask.config.set({"distributed.scheduler.allowed-failures": 0}))  # the crew counts deaths
        security = stack.enter_context(_certificate(folder.resolve()))
        where = {key: options[key] for key in _OF_SCHEDULER if key in options}
        how = {"protocol": "tls://", "security": security, "dashboard": False, **where}
        scheduler = {"cls": Scheduler, "options": how}
        cluster = stack.enter_context(SpecCluster(scheduler=scheduler, security=security, silence_logs=False))
        client = stack.enter_context(Client(cluster, set_as_default=False))
        for noisy in ("distributed.client", "asyncio"):  # which warn of results that went with a job
            logger = logging.getLogger(noisy)
            stack.callback(logger.setLevel, logger.level)
            logger.setLevel(logging.CRITICAL)

        def script(worker: str) -> str:
            return job_script(options, ranks, worker, cluster.scheduler_address, security)

        crew = SlurmCrew(client, jobs, script, str((_DEFAULTS | options)["walltime"]))
        stack.callback(crew.cancel)
        yield crew


@dataclass
class _Job:
    """A job that was sent."""

    id: str
    name: str  # of its worker
    sent: float
    address: str | None = None  # of its worker while it is connected
    began: bool = False  # whether the worker has ever been connected
    lost: bool = False  # whether it ran once and is gone
    carried: int = 0  # number of calls that it is done with
    key: str | None = None  # of the call that it is at
    future: Any = None


class SlurmCrew:
    """Jobs of SLURM as workers of a campaign; see `jamlab.campaign.workers.Crew`."""

    def __init__(self, client: "Client", width: int, script: Callable[[str], str], walltime: str) -> None:
        self.width = width
        self.cause = (
            f"jobs of SLURM ended again and again before it was done, {_MOST_ALONE} of them at it from the beginning: "
            f"raise walltime = {walltime} or memory of [slurm], then `jamlab campaign resume --retry-failed`"
        )
        self._client, self._script, self._walltime = client, script, walltime
        self._jobs: dict[str, _Job] = {}  # by the name of the worker
        self._calls: dict[str, Call] = {}
        self._waiting: deque[str] = deque()
        self._ended: queue.Queue[tuple[str, Any]] = queue.Queue()  # worker, and future of its call
        self._done: deque[tuple[str, Any]] = deque()  # what `wait` returns next
        self._deaths: Counter[str] = Counter()
        self._alone: Counter[str] = Counter()
        self._count = self._still = self._refusals = 0
        self._watched = self._looked = self._next_try = 0.0

    def submit(self, key: str, call: Call) -> None:
        """Have a call carried by the next job that is free."""
        self._calls[key] = call
        self._waiting.append(key)

    def wait(self) -> tuple[str, Any]:
        """Wait for the next call that ends, and replace jobs meanwhile; see `Crew`."""
        while True:
            self._watch()
            if self._done:
                key, result = self._done.popleft()
                del self._calls[key]
                return key, result
            self._hand_out()
            try:
                name, future = self._ended.get(timeout=_PAUSE)
            except queue.Empty:
                continue
            job = self._jobs.get(name)
            if job is None or job.future is not future:
                continue  # of a job that was given up meanwhile
            found = self._take(job, future)
            if found is not None:
                return found

    def _take(self, job: _Job, future: Any) -> tuple[str, Any] | None:
        """What a call returned; None if its worker died."""
        from distributed.scheduler import KilledWorker

        key, status = job.key, future.status
        assert key is not None
        if status == "error" and not isinstance(error := future.exception(), KilledWorker):
            raise EngineError(f"workers cannot run a task: {error}; they must have the driver's jamlab") from error
        try:
            if status != "finished":  # the worker died, or it died with the result: "lost" or "pending"
                raise TimeoutError
            result = future.result(timeout=_FETCH)
        except (TimeoutError, CancelledError):  # a task that is done has its file, so that running it again is quick
            job.lost, job.address = True, None
            return None
        future.release()
        job.key = job.future = None
        job.carried += 1
        del self._calls[key]
        return key, result

    def _watch(self) -> None:
        """Notice jobs that began and jobs that ended, and send others for those."""
        now = time.monotonic()
        if now - self._watched < _PAUSE / 2:
            return
        self._watched = now
        known = self._client.scheduler_info(n_workers=-1)["workers"]
        connected = {str(worker["name"]): address for address, worker in known.items()}
        for job in self._jobs.values():
            address = connected.get(job.name)
            job.lost |= job.address is not None and address != job.address
            if job.address is None and not job.lost and address is not None:
                job.began, self._still = True, 0
                job.address = address
        ended = 0
        if any(job.lost for job in self._jobs.values()) or now - self._looked > _LOOK:
            self._looked = now
            ended = self._drop_ended(self._listed(), now)
        sent = self._send(now)
        if ended and (self._waiting or sent):
            warnings.warn(
                f"{ended} of {self.width} jobs ended before the tasks were done (walltime {self._walltime}): {sent} "
                f"more sent, {self._count} by now; tasks that were under way run again",
                stacklevel=2,
            )

    def _drop_ended(self, listed: dict[str, str] | None, now: float) -> int:
        """Drop the jobs that ended; a job that is requeued remains, without its call."""
        ended = 0
        for job in list(self._jobs.values()):
            if job.address is not None and not job.lost:
                continue
            queued = listed is not None and listed.get(job.id) in _PENDING
            if job.lost:
                self._take_back(job, alone=job.carried == 0 and not queued)
                if queued:  # requeued: it comes back under its id and the name of its worker
                    job.lost, job.address, job.carried = False, None, 0
                    continue
                if listed is None or job.id in listed:
                    self._scancel([job.id])
            elif listed is None or job.id in listed or now - job.sent < _REGISTERED:
                continue
            elif not job.began:
                self._still += 1
                if self._still > _MOST_STILL:
                    said = f"see the output of the last, {job.id}, correct [slurm], then `jamlab campaign resume`"
                    raise EngineError(
                        f"{self._still} jobs of SLURM in a row ended before their worker answered: {said}"
                    )
            del self._jobs[job.name]
            ended += 1
        return ended

    def _take_back(self, job: _Job, alone: bool) -> None:
        """Have the call of a job that ended carried again, or give it up."""
        key, future = job.key, job.future
        job.key = job.future = None
        if key is None:
            return
        future.release()
        self._deaths[key] += 1
        self._alone[key] += alone
        if self._alone[key] >= _MOST_ALONE or self._deaths[key] >= _MOST_DEATHS:
            self._done.append((key, None))
        else:
            self._waiting.appendleft(key)

    def _hand_out(self) -> None:
        """Give each free job a call: to a new one first what another job was not done with."""
        free = [job for job in self._jobs.values() if job.address is not None and not job.lost and job.key is None]
        for job in sorted(free, key=lambda job: job.carried):
            if not self._waiting:
                return
            suited = (key for key in self._waiting if (self._deaths[key] > 0) == (job.carried == 0))
            job.key = key = next(suited, self._waiting[0])
            self._waiting.remove(key)
            again = f"{key}-{self._deaths[key]}"
            where = {"workers": [job.address], "allow_other_workers": False}
            job.future = self._client.submit(*self._calls[key], key=again, pure=False, **where)
            job.future.add_done_callback(lambda future, name=job.name: self._ended.put((name, future)))

    def _send(self, now: float) -> int:
        """Send jobs until there is one for each call, and no more than wanted; the number of them."""
        sent = 0
        while now >= self._next_try and len(self._jobs) < min(self.width, len(self._calls)):
            self._count += 1
            name = f"jamlab-{os.getpid()}-{self._count}"
            code, said = _run_script(["sbatch"], self._script(name))
            number = re.search(r"\d+", said)
            if code == 0 and number is not None:
                self._jobs[name] = _Job(number[0], name, now)
                self._refusals, sent = 0, sent + 1
                continue
            reason = f"SLURM refuses a job: {said}"
            if not self._jobs and self._refusals >= len(_RETRIES):
                raise EngineError(f"{reason}; when it takes jobs again, `jamlab campaign resume`")
            pause = _RETRIES[min(self._refusals, len(_RETRIES) - 1)]
            self._refusals, self._next_try = self._refusals + 1, now + pause
            warnings.warn(
                f"{reason}; {len(self._jobs)} of {self.width} jobs are there; tried again in {pause:g} s", stacklevel=3
            )
        return sent

    def _listed(self) -> dict[str, str] | None:
        """Id and state of the jobs of this user that are queued or run; None if SLURM does not say."""
        code, said = _run(["squeue", "--noheader", "--user", str(os.getuid()), "--format", "%i %t"], joined=False)
        if code != 0:
            return None
        lines = [line.split() for line in said.splitlines() if line.strip()]
        return {words[0]: words[1] if len(words) > 1 else "" for words in lines}

    def cancel(self) -> None:
        """Cancel the jobs that are left."""
        self._scancel([job.id for job in self._jobs.values()])

    def _scancel(self, ids: list[str]) -> None:
        if ids:
            _run(["scancel", *ids])


def _run(words: Sequence[str], joined: bool = True) -> tuple[int, str]:
    """Exit code of a command and what it said, on one line if `joined`; 127 if it cannot be run."""
    try:
        done = subprocess.run(words, capture_output=True, text=True, timeout=_COMMAND_TIMEOUT, check=False)
    except (OSError, subprocess.SubprocessError) as error:
        return 127, f"{words[0]} cannot be run: {error}"
    said = done.stdout if done.returncode == 0 else done.stderr or done.stdout
    return done.returncode, (" ".join(said.split()) or f"{words[0]} ended with {done.returncode}") if joined else said


def _run_script(words: Sequence[str], script: str) -> tuple[int, str]:
    """Hand a script to a command as a file, of which SLURM keeps a copy."""
    with tempfile.NamedTemporaryFile("w", suffix=".sh") as file:
        file.write(script)
        file.flush()
        return _run([*words, file.name])


@contextlib.contextmanager
def _certificate(folder: Path) -> "Iterator[Security]":
    """Certificate and key of one run, which both sides of every connection must show, in files of this user alone."""
    from distributed.security import Security

    try:
        made = Security.temporary()
    except ImportError:
        raise InputError("SLURM needs cryptography, to keep others out: pip install 'jamlab[slurm]'") from None
    with tempfile.TemporaryDirectory(prefix=CERTIFICATE, dir=folder) as place:  # which nobody else may enter
        key, certificate = Path(place, "key.pem"), Path(place, "certificate.pem")
        key.write_text(made.tls_scheduler_key)
        certificate.write_text(made.tls_scheduler_cert)
        shown = {f"tls_{role}_cert": str(certificate) for role in ("client", "scheduler", "worker")}
        held = {f"tls_{role}_key": str(key) for role in ("client", "scheduler", "worker")}
        yield Security(require_encryption=True, tls_ca_file=str(certificate), **shown, **held)
