"""What jamlab asks of each batch system beyond what `dask_jobqueue` knows: walltime, cores of a job, jobs in the queue.

How a site submits (queue, account, memory, walltime, ...) stands in the settings of `dask_jobqueue`, by default in
`~/.config/dask/jobqueue.yaml`, and nowhere in jamlab.
"""

import getpass
import re
from collections.abc import Mapping
from typing import Any

from jamlab.errors import InputError

SYSTEMS = {name.lower(): name for name in ("HTCondor", "LSF", "Moab", "OAR", "PBS", "SGE", "SLURM")}
SETTINGS = "~/.config/dask/jobqueue.yaml"

# what a user has in the queue, the number of a job first in each line
_LISTS = {
    "slurm": "squeue --noheader --format=%A --user={user}",
    "pbs": "qselect -u {user}",
    "sge": "qstat -u {user}",
    "lsf": "bjobs -w -u {user}",
    "oar": "oarstat -u {user}",
    "moab": "showq -w user={user}",
    "htcondor": "condor_q {user} -format %d.0\\n ClusterId",
}

_SECONDS = {"s": 1, "m": 60, "h": 3600, "d": 86_400}
_FIELDS = {"slurm": ("m", "ms", "hms"), "lsf": ("m", "hm"), "oar": ("h", "hm", "hms")}  # by their number
_OTHER_FIELDS = ("s", "ms", "hms", "dhms")

# key -> how the number of cores stands in it
_CORES = {
    "slurm": ("job-cpu", r"^(\d+)$"),
    "lsf": ("ncpus", r"^(\d+)$"),
    "pbs": ("resource-spec", r"\b(?:ncpus|ppn|procs)=(\d+)"),
    "moab": ("resource-spec", r"\b(?:ncpus|ppn|procs)=(\d+)"),
    "oar": ("resource-spec", r"\bcore=(\d+)"),
    "sge": ("job-extra-directives", r"-pe\s+\S+\s+(\d+)"),
}


def list_command(system: str) -> list[str]:
    """Words of the command that lists the jobs of this user."""
    user = getpass.getuser()
    return [word.format(user=user) for word in _LISTS[system].split(" ")]


def listed_jobs(output: str) -> set[str]:
    """Numbers of the jobs in what that command prints."""
    return {found[1] for line in output.splitlines() if (found := re.match(r"\s*(\d+)", line))}


def walltime_seconds(system: str, walltime: Any) -> int | None:
    """Length of a job in s from the key `walltime`; None if there is none."""
    if walltime is None:
        return None
    where = f"jobqueue.{system}.walltime = {walltime!r} in {SETTINGS}"
    if not isinstance(walltime, str):  # YAML reads 12:00:00 as the number 43200, and SLURM that as minutes
        raise InputError(f'{where} is a number: write it in quotes, such as walltime: "12:00:00"')
    days, dash, rest = walltime.rpartition("-") if system == "slurm" else ("", "", walltime)
    numbers = rest.split(":")
    forms = ("h", "hm", "hms") if dash else _FIELDS.get(system, _OTHER_FIELDS)
    if not all(number.isdecimal() for number in [*numbers, *([days] if dash else [])]) or len(numbers) > len(forms):
        raise InputError(f'{where}: give hours, minutes and seconds as this system does, such as walltime: "12:00:00"')
    units = forms[len(numbers) - 1]
    length = sum(int(number) * _SECONDS[unit] for number, unit in zip(numbers, units, strict=True))
    return length + (int(days) * _SECONDS["d"] if dash else 0)


def check_cores(system: str, settings: Mapping[str, Any], cores: int) -> None:
    """Refuse settings that book fewer cores than a job needs; `dask_jobqueue` books as many unless they say otherwise,
    but for SGE, where the name of the parallel environment is the site's."""
    if system not in _CORES:
        return
    key, form = _CORES[system]
    given = settings.get(key)
    where = f"a job needs {cores} cores, and jobqueue.{system}.{key} in {SETTINGS}"
    text = "\n".join(map(str, given)) if isinstance(given, list | tuple) else "" if given is None else str(given)
    found = re.search(form, text, re.MULTILINE)
    if system == "sge" and cores > 1 and not found:
        raise InputError(f'{where} names no parallel environment: add "-pe smp {cores}", with the name at your site')
    if found and int(found[1]) < cores:
        raise InputError(f"{where} = {given!r} books {found[1]}: book {cores}, or lower ranks")
