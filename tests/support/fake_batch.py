"""Batch systems that run jobs on this machine, as the command-line programs that `dask_jobqueue` and users call.

    with FakeBatch(folder, slots=2, walltime="00:00:20") as batch:
        subprocess.run(["sbatch", "job.sh"], env=batch.environment())

A process of its own (`serve`) starts jobs, ends them at their walltime by SIGTERM to all their processes and SIGKILL
`kill_wait` s later, and kills what is left when the `with` block ends or the process that began it dies. `log()` lists
what happened. Jobs see what the real systems give them: SLURM and LSF hand on the environment, the others do not; PBS
starts in HOME; output stands where the system puts it.
"""

import getpass
import json
import math
import os
import random
import re
import select
import shlex
import signal
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from batch_jobs import output_files, read_job, variables_of

MARK = "FAKE_BATCH_JOB"  # variable of the environment of all processes of a job
PROGRAMS = {
    "slurm": ("sbatch", "scancel", "squeue"),
    "pbs": ("qsub", "qdel", "qselect"),
    "sge": ("qsub", "qdel", "qstat"),
    "moab": ("msub", "canceljob", "showq"),
    "lsf": ("bsub", "bkill", "bjobs"),
    "oar": ("oarsub", "oardel", "oarstat"),
    "htcondor": ("condor_submit", "condor_rm", "condor_q"),
}
SUBMITTED = {  # what is printed
    "slurm": "Submitted batch job {0}",
    "pbs": "{0}.headnode",
    "sge": 'Your job {0} ("{1}") has been submitted',
    "moab": "\n{0}",
    "lsf": "Job <{0}> is submitted to default queue <normal>.",
    "oar": "OAR_JOB_ID={0}",
    "htcondor": "Submitting job(s).\n1 job(s) submitted to cluster {0}.",
}
REFUSED = {  # lines on stderr, and the exit code
    "slurm": (
        "sbatch: error: QOSMaxSubmitJobPerUserLimit\nsbatch: error: Batch job submission failed: Job violates "
        "accounting/QOS policy (job submit limit, user's size and/or time limits)",
        1,
    ),
    "pbs": ("qsub: would exceed complex's per-user limit of jobs in 'Q' state", 38),
    "sge": ("Unable to run job: job rejected: Only 2 jobs are allowed per user (current job count: 2).\nExiting.", 25),
    "moab": ("\nERROR: cannot submit job - job violates queue limits", 1),
    "lsf": ("Queue <normal> has been closed. Job not submitted.", 255),
    "oar": ("# ADMISSION RULE> there are too many jobs in this queue\n# ERROR: admission rule", 5),
    "htcondor": ("ERROR: Failed submission for job 1.-1 - aborting entire submit\nERROR: Failed to queue job.", 1),
}
NO_SERVER = "sbatch: error: Batch job submission failed: Unable to contact slurm controller (connect failure)"
HEADINGS = {
    "qstat": f"job-ID     prior   name       user         state submit/start at\n{'-' * 70}",
    "bjobs": "JOBID   USER    STAT  QUEUE      FROM_HOST   EXEC_HOST   JOB_NAME   SUBMIT_TIME",
    "oarstat": "Job id     S User     Duration   System message\n---------- - -------- ---------- ----------------",
    "showq": "active jobs------------------------\nJOBID              USERNAME      STATE PROCS",
}
TOO_LARGE = "sbatch: error: Batch job submission failed: Requested node configuration is not available"
FIRST_SIGNAL = {"sge": signal.SIGKILL, "lsf": signal.SIGUSR2}  # at the walltime; SIGTERM elsewhere


@dataclass
class FakeBatch:
    """A batch system of `slots` cores under a folder, which is made; the rest are chances per job and times in s."""

    root: Path
    slots: int = 2
    walltime: str = "00:30:00"  # of jobqueue.yaml
    kill_wait: float = 3.0  # s between the first signal of the system and SIGKILL
    queue_wait: tuple[float, float] = (0.0, 0.0)
    refuse: float = 0.0  # submissions that are refused
    requeue: float = 0.0  # jobs that are killed once in the middle and start again
    lose: float = 0.0  # jobs that vanish without a word: half of them before they start
    within: float = 15.0  # s after the start within which a job is requeued or lost
    seed: int = 1
    settings: dict = field(default_factory=dict)  # further entries of jobqueue.yaml, of all systems

    def __enter__(self):
        for part in ("bin", "jobs", "cancel", "home/.config/dask", "tmp"):
            (self.root / part).mkdir(parents=True, exist_ok=True)
        self.change()
        for name in {name for names in PROGRAMS.values() for name in names}:
            program = self.root / "bin" / name
            line = shlex.join([sys.executable, "-E", "-S", __file__, str(self.root), name])
            program.write_text(f'#!/bin/sh\nexec {line} "$@"\n')
            program.chmod(0o755)
        yaml = {name: self._site(name) for name in PROGRAMS}
        (self.root / "home/.config/dask/jobqueue.yaml").write_text(json.dumps({"jobqueue": yaml}, indent=1))
        line = [sys.executable, "-E", "-S", __file__, str(self.root), "serve"]
        self._server = subprocess.Popen(line, stdin=subprocess.PIPE)
        (self.root / "server").write_text(str(self._server.pid))
        return self

    def __exit__(self, *error):
        self._server.stdin.close()
        self._server.wait(30)
        assert not self.processes(), "processes of jobs survived"

    def _site(self, system):
        known = {"memory": "500MB", "walltime": self.walltime[:5] if system == "lsf" else self.walltime}
        known |= {"htcondor": {"disk": "1GB"}, "oar": {"memory-per-core-property-name": "not_applicable"}}.get(
            system, {}
        )
        if system == "htcondor":
            del known["walltime"]
        return known | self.settings

    def change(self, **modes):
        """Change modes while it runs."""
        vars(self).update(modes)
        content = {name: getattr(self, name) for name in MODES}
        _replace(self.root / "modes.json", json.dumps(content))

    def environment(self):
        """Variables with which the programs are found, the site's settings are read, and HOME and /tmp are here."""
        path = f"{self.root / 'bin'}{os.pathsep}{os.environ['PATH']}"
        return os.environ | {"PATH": path, "HOME": str(self.root / "home"), "TMPDIR": str(self.root / "tmp")}

    def log(self, event=None):
        """What happened, as one dict each with `event`, `job` and `time`."""
        with suppress(FileNotFoundError):
            entries = [json.loads(line) for line in (self.root / "log").read_text().splitlines()]
            return [entry for entry in entries if event in (None, entry["event"])]
        return []

    def processes(self, job=None):
        """Pids of what jobs, or one of them, have started and that has not ended, whoever their parents are."""
        return processes_of(self.root, job)


MODES = ("slots", "kill_wait", "queue_wait", "refuse", "requeue", "lose", "within", "seed")


def processes_of(root, job=None):
    """Pids of the processes with the mark of a job, or of any job, under a root."""
    wanted, found = f"{MARK}={root}:{'' if job is None else job}".encode(), []
    for entry in os.listdir("/proc"):
        if entry.isdecimal():
            with suppress(OSError):
                marks = [v for v in Path(f"/proc/{entry}/environ").read_bytes().split(b"\0") if v.startswith(wanted)]
                if any(job is None or v == wanted for v in marks):
                    found.append(int(entry))
    return found


def _replace(path, text):
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    temporary.write_text(text)
    temporary.rename(path)


def _note(root, event, job, **more):
    with open(root / "log", "a") as file:
        file.write(json.dumps({"event": event, "job": job, "time": time.time()} | more) + "\n")


def submit(root, system, words):
    """`sbatch`, `qsub`, ...: queue a job and print its id; the exit code."""
    modes = json.loads((root / "modes.json").read_text())
    if not Path(f"/proc/{(root / 'server').read_text()}").exists():
        print(NO_SERVER, file=sys.stderr)
        return 1
    job = read_job(system, words)
    before = len(list((root / "jobs").iterdir()))
    count = sum(1 for line in _lines(root / "log") if '"refused"' in line)
    if random.Random(f"{modes['seed']}-{before}-{count}").random() < modes["refuse"]:
        text, code = REFUSED[job["system"]]
        _note(root, "refused", None)
        print(text, file=sys.stderr)
        return code
    if job["cores"] > modes["slots"]:
        print(TOO_LARGE, file=sys.stderr)
        return 1
    first = None
    for index in job.pop("array"):
        number = _new_number(root)
        first = first or number
        mine = job | {"number": number, "index": index, "first": first}
        _note(root, "submitted", number, name=job["name"], walltime=job["walltime"], cores=job["cores"])
        _replace(root / "jobs" / str(number) / "job.json", json.dumps(mine))
    print(SUBMITTED[job["system"]].format(first, job["name"]))
    return 0


def _lines(path):
    return path.read_text().splitlines() if path.exists() else []


def _new_number(root):
    number = 1
    while True:
        try:
            (root / "jobs" / str(number)).mkdir()
            return number
        except FileExistsError:
            number += 1


def cancel(root, words):
    """`scancel`, `qdel`, ...: end jobs; the exit code."""
    code = 0
    for word in (w for w in words if not w.startswith("-")):
        number = re.match(r"\d+", word)
        if number is None or not (root / "jobs" / number[0]).exists():
            print(f"scancel: error: Kill job error on job id {word}: Invalid job id specified", file=sys.stderr)
            code = 1
        else:
            (root / "cancel" / number[0]).touch()
    return code


def queue(root, program, words):
    """`squeue`, `qstat`, ...: jobs that wait or run, the number of a job first in each line; the exit code."""
    jobs = []
    for folder in sorted((root / "jobs").iterdir(), key=lambda each: int(each.name)):
        state = folder / "state"
        found = state.read_text() if state.exists() else "PD"
        if found != "over" and (folder / "job.json").exists():
            name = json.loads((folder / "job.json").read_text())["name"]
            jobs.append((folder.name, name, found, time.time() - state.stat().st_mtime if found == "R" else 0.0))
    if program == "squeue" and not {"--noheader", "-h"} & set(words):
        print("             JOBID PARTITION     NAME     USER ST       TIME  NODES NODELIST(REASON)")
    elif program in HEADINGS and jobs:
        print(HEADINGS[program])
    for number, name, state, seconds in jobs:
        if program == "squeue" and "--format=%A" not in words:
            passed, where = f"{int(seconds // 60)}:{int(seconds % 60):02d}", "node1" if state == "R" else "(Priority)"
            user = getpass.getuser()
            print(f"{number:>18} {'normal':>9} {name[:8]:>8} {user[:8]:>8} {state:>2} {passed:>10}      1 {where}")
        else:
            print(
                {"qselect": f"{number}.headnode", "squeue": number, "condor_q": f"{number}.0"}.get(
                    program, f"{number:>8} {name} {state}"
                )
            )
    return 0


@dataclass
class Job:
    """A job as the server sees it."""

    wanted: dict
    ready: float  # when it may start
    lost: bool = False  # vanishes before it starts
    break_at: float = math.inf  # s after the start at which it is killed, and
    again: bool = False  # whether it starts again
    process: subprocess.Popen | None = None
    end: float = math.inf
    kill: float = math.inf
    restarts: int = 0

    @property
    def number(self):
        return self.wanted["number"]


class Server:
    """Starts and ends jobs."""

    def __init__(self, root):
        self.root, self.waiting, self.running, self.seen = root, [], [], set()
        self.parent = os.getppid()

    def serve(self):
        """Until the process that began this one is gone."""
        while os.getppid() == self.parent and not self._told():
            self.modes = json.loads((self.root / "modes.json").read_text())
            self._accept()
            self._cancel()
            self._watch()
            self._start()
        for job in [*self.running, *self.waiting]:
            self._signal(job, signal.SIGKILL)
        while left := processes_of(self.root):
            for pid in left:
                with suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
            for job in self.running:
                job.process.poll()
            time.sleep(0.05)

    def _told(self):
        """Whether stdin was closed, after a moment."""
        return bool(select.select([0], [], [], 0.05)[0])

    def _accept(self):
        for folder in (self.root / "jobs").iterdir():
            if folder.name not in self.seen and (folder / "job.json").exists():
                self.seen.add(folder.name)
                chance = random.Random(f"{self.modes['seed']}-{folder.name}")
                job = Job(json.loads((folder / "job.json").read_text()), time.time())
                job.ready += chance.uniform(*self.modes["queue_wait"])
                if chance.random() < self.modes["lose"]:
                    job.lost = chance.random() < 0.5
                    job.break_at = chance.uniform(0.0, self.modes["within"])
                elif chance.random() < self.modes["requeue"]:
                    job.break_at, job.again = chance.uniform(0.0, self.modes["within"]), True
                self.waiting.append(job)
        self.waiting.sort(key=lambda job: job.number)

    def _start(self):
        for job in list(self.waiting):
            used = sum(each.wanted["cores"] for each in self.running)
            if time.time() < job.ready or used + job.wanted["cores"] > self.modes["slots"]:
                continue
            self.waiting.remove(job)
            if job.lost:
                self._over(job, "lost")
                continue
            self._launch(job)
            self.running.append(job)

    def _launch(self, job):
        wanted, now = job.wanted, time.time()
        folder = self.root / "jobs" / str(job.number)
        script = folder / "script"
        script.write_text(wanted["script"] if wanted["script"].startswith("#!") else f"#!/bin/sh\n{wanted['script']}")
        script.chmod(0o700)
        limit = wanted["walltime"]
        job.end = math.inf if limit is None else now + limit
        variables = variables_of(wanted, now, job.end, job.restarts) | {MARK: f"{self.root}:{job.number}"}
        place = wanted["environment"].get("HOME", "/") if wanted["system"] in ("pbs", "moab") else wanted["folder"]
        place = str(folder) if wanted["system"] == "htcondor" else place
        out, error = output_files(wanted)
        with open(out, "ab") as stdout, open(error, "ab") as stderr:
            how = {"stdin": subprocess.DEVNULL, "stdout": stdout, "stderr": stderr, "start_new_session": True}
            job.process = subprocess.Popen([str(script)], cwd=place, env=wanted["environment"] | variables, **how)
        _replace(folder / "state", "R")
        _note(self.root, "started", job.number, restarts=job.restarts)
        job.break_at += now

    def _watch(self):
        now = time.time()
        for job in list(self.running):
            if job.process.poll() is not None and not processes_of(self.root, job.number):
                self._over(job, "ended", code=job.process.returncode)
            elif now >= job.break_at and job.kill == math.inf:
                self._signal(job, signal.SIGKILL)
                job.process.wait()
                if not job.again:
                    self._over(job, "lost")
                    continue
                _note(self.root, "requeued", job.number)
                self.running.remove(job)
                job.ready, job.break_at, job.again, job.restarts = now + 1.0, math.inf, False, job.restarts + 1
                self.waiting.append(job)
            elif now >= job.end and job.kill == math.inf:
                self._end(job, "walltime", FIRST_SIGNAL.get(job.wanted["system"], signal.SIGTERM))
            elif now >= job.kill:
                _note(self.root, "killed", job.number, processes=len(processes_of(self.root, job.number)))
                self._signal(job, signal.SIGKILL)

    def _end(self, job, event, number):
        _note(self.root, event, job.number)
        _replace(self.root / "jobs" / str(job.number) / "state", "CG")
        self._signal(job, number)
        job.kill = time.time() + self.modes["kill_wait"]

    def _cancel(self):
        for mark in (self.root / "cancel").iterdir():
            mark.unlink()
            for job in [each for each in self.waiting if str(each.number) == mark.name]:
                self.waiting.remove(job)
                self._over(job, "cancelled")
            for job in [each for each in self.running if str(each.number) == mark.name]:
                if job.kill == math.inf:
                    self._end(job, "cancelled", signal.SIGTERM)

    def _signal(self, job, number):
        for pid in processes_of(self.root, job.number):
            with suppress(ProcessLookupError):
                os.kill(pid, number)

    def _over(self, job, event, **more):
        if job in self.running:
            self.running.remove(job)
        _note(self.root, event, job.number, **more)
        _replace(self.root / "jobs" / str(job.number) / "state", "over")


def main(root, name, *words):
    """Be one of the programs."""
    if name == "serve":
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the driver
        Server(root).serve()
        return 0
    if name in [lists for _, _, lists in PROGRAMS.values()]:
        return queue(root, name, words)
    systems = [system for system, (submits, *_) in PROGRAMS.items() if submits == name]
    return submit(root, systems[0], list(words)) if systems else cancel(root, words)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), *sys.argv[2:]))
