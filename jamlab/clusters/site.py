"""Jobs of a batch system as the settings of the site want them, in the file of `dask_jobqueue`."""

import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from jamlab.clusters.batch_system import SETTINGS, SYSTEMS, check_cores, walltime_seconds
from jamlab.errors import InputError


class Site:
    """Jobs as the site's settings want them."""

    def __init__(self, where: str, folder: Path, ranks: int) -> None:
        import dask

        self.where = where
        self._settings: Mapping[str, Any] = dask.config.get(f"jobqueue.{where}")
        self.cores = self._get("cores") or ranks
        if self.cores < ranks:
            raise InputError(
                f"{self._key('cores')} = {self.cores}: a task has ranks = {ranks}: book as many, or lower ranks"
            )
        self.workers = self.cores // ranks
        if self._get("memory") is None:
            raise InputError(f"{where} needs the memory of a job: set {self._key('memory')}, such as memory: 2GB")
        check_cores(where, self._settings, self.cores)
        self._seconds = walltime_seconds(where, self._get("walltime"))
        usual = dask.config.merge(*dask.config.defaults)
        self._is_usual = self._get("walltime") == dask.config.get(f"jobqueue.{where}.walltime", None, usual)
        self.has_own_logs = not self._get("log-directory")
        self.logs = Path(self._get("log-directory") or (folder / "jobs").absolute())
        shared = self._get("shared-temp-directory")
        self.shared = Path(os.path.expanduser(os.path.expandvars(shared))) if shared else folder

    def _get(self, key: str) -> Any:
        return self._settings.get(key)

    def _key(self, key: str) -> str:
        return f"jobqueue.{self.where}.{key} in {SETTINGS}"

    def remedy(self) -> str:
        """What to look at when jobs fail."""
        keys = "queue, account, walltime, memory and interface"
        return f"{keys} are keys of jobqueue.{self.where} in {SETTINGS}; what jobs print is in {self.logs}"

    def check_program(self) -> None:
        """Refuse a machine without the commands of the batch system."""
        program = shlex.split(_job_class(self.where).submit_command)[0]
        if shutil.which(program) is None:
            raise InputError(f"there is no {program} on this machine: run on one from which {self.where} takes jobs")

    def scheduler(self, security: Any) -> dict[str, Any]:
        """How Dask's scheduler is started in this process: without pages, unless the site wants them."""
        from distributed import Scheduler

        how = {"protocol": "tls://", "security": security, "interface": self._get("interface")}
        wanted = self._get("scheduler-options") or {}
        how |= {} if wanted.get("dashboard") else {"dashboard": False, "dashboard_address": "127.0.0.1:0"}
        return {"cls": Scheduler, "options": how | wanted}

    def dashboard(self, cluster: Any) -> str | None:
        """Address of the pages, if the site wants them."""
        wanted = (self._get("scheduler-options") or {}).get("dashboard")
        return str(cluster.dashboard_link) if wanted else None

    def job(self, name: str, address: str, keys: Any) -> Any:
        """A job to be sent."""
        python = f"{self._get('python') or shlex.quote(sys.executable)} -P"
        settings: dict[str, Any] = {"cores": self.cores, "processes": self.workers, "nanny": False, "python": python}
        settings |= {"protocol": "tls://", "security": keys}
        settings |= {"worker_command": f"jamlab.clusters.batch_worker {self.workers}"}
        own = ["--nthreads", "1", "--no-nanny", "--preload", "jamlab.clusters.batch_worker"]
        own += ["--no-dashboard", "--dashboard-address", "127.0.0.1:0"]
        settings |= {"worker_extra_args": [*(self._get("worker-extra-args") or []), *own]}
        settings |= {"job_script_prologue": [*(self._get("job-script-prologue") or []), *self._exports()]}
        settings |= {"log_directory": str(self.logs)}
        if self._get("name") == "dask-worker":  # of Dask itself
            settings["job_name"] = "jamlab"
        if self._get("death-timeout") == 60:  # of Dask itself: longer than a job should outlive its driver
            settings["death_timeout"] = 20
        try:
            return _job_class(self.where)(address, name=name, **settings)
        except (TypeError, ValueError) as error:
            said = f"jobqueue.{self.where} in {SETTINGS}: {first_line(error)}"
            raise InputError(f"{said}; its keys are those of dask_jobqueue.{SYSTEMS[self.where]}Cluster") from error

    def _exports(self) -> list[str]:
        """Lines of the job script: one thread, when the job ends, where jamlab is."""
        lines = [f"export {name}=1" for name in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")]
        if self._seconds is not None:
            if self._is_usual:
                lines.append(f"# a job ends after {self._get('walltime')}, as Dask has it: set {self._key('walltime')}")
            lines.append(f"export JAMLAB_JOB_ENDS=$(($(date +%s) + {self._seconds}))")
        if not self._get("python") and (place := _place_to_add()):
            lines.append(f"export PYTHONPATH={shlex.quote(place)}")
        return lines


def _job_class(where: str) -> Any:
    import dask_jobqueue

    return getattr(dask_jobqueue, f"{SYSTEMS[where]}Cluster").job_cls


def _place_to_add() -> str | None:
    """The folder of jamlab, if this Python does not find the same one by itself."""
    here = str(Path(__file__).parents[1] / "__init__.py")
    program = "import importlib.util as u; print(u.find_spec('jamlab').origin)"
    plain = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    line = [sys.executable, "-P", "-c", program]
    found = subprocess.run(line, env=plain, cwd="/", capture_output=True, text=True, check=False)
    return None if found.stdout.strip() == here else str(Path(here).parents[1])


def first_line(error: BaseException) -> str:
    """The first line of what an error says, or its name."""
    lines = str(error).splitlines()
    return lines[0][:200] if lines else type(error).__name__
