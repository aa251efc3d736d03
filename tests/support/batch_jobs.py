"""What a submission to a batch system asks for, and what its job is given: directives, options, variables, output."""

import argparse
import math
import os
import re
import shlex
import sys
from pathlib import Path

DIRECTIVES = {"slurm": "#SBATCH", "pbs": "#PBS", "sge": "#$", "moab": "#PBS", "lsf": "#BSUB"}
KEEPS_ENVIRONMENT = ("slurm", "lsf")


def seconds(text, system="slurm"):
    """Length of a walltime."""
    days, _, rest = text.rpartition("-")
    parts = [float(part) for part in rest.split(":")]
    if system == "lsf":
        parts = [*parts, 0.0]
    elif len(parts) == 1:
        parts = [parts[0], 0.0] if system == "slurm" else parts
    total = 0.0
    for part in parts:
        total = 60 * total + part
    return total + 86400 * float(days or 0)


def read_job(system, words):
    """What the words of a submission and the directives in its script ask for."""
    if system == "htcondor":
        script = _condor_script(Path(words[-1]).read_text())
        options = []
    elif system == "oar":
        script, options = words[-1], words[:-1]
    else:
        options, script = _script_of(words)
        if system in ("pbs", "sge"):
            system = "sge" if "\n#$ " in script else "pbs"
        mark = DIRECTIVES[system]
        lines = [line[len(mark) :] for line in script.splitlines() if line.startswith(f"{mark} ")]
        options = [*(word for line in lines for word in shlex.split(line)), *options]
    known = _options(system, options)
    ends = [int(end) for end in known.array.partition("%")[0].split("-")] if known.array else []
    return {
        "system": system,
        "script": script,
        "array": list(range(ends[0], ends[-1] + 1)) if ends else [None],
        "name": known.name or "job",
        "output": known.output,
        "error": known.error,
        "cores": known.cores,
        "walltime": None if known.walltime is None else seconds(known.walltime, system),
        "folder": os.getcwd(),
        "environment": dict(os.environ) if system in KEEPS_ENVIRONMENT else _login_environment(),
    }


def _login_environment():
    return {name: os.environ[name] for name in ("HOME", "USER", "LOGNAME", "LANG") if name in os.environ} | {
        "PATH": "/usr/local/bin:/usr/bin:/bin"
    }


def _script_of(words):
    """Options before the script, and its text: a file, `--wrap` or stdin."""
    for place, word in enumerate(words):
        if word.startswith("--wrap"):
            _, equals, text = word.partition("=")
            return words[:place], f"#!/bin/sh\n{text if equals else words[place + 1]}\n"
    if words and Path(words[-1]).is_file():
        return words[:-1], Path(words[-1]).read_text()
    return words, sys.stdin.read()


def _condor_script(text):
    (quoted,) = re.findall(r'^Arguments = "(.*)"$', text, re.MULTILINE)
    words = [part.replace("''", "'") for part in re.findall(r"'((?:[^']|'')*)'|(\S+)", quoted) for part in part if part]
    assert words[0] == "-c", text
    return "#!/bin/sh\n" + words[1].replace('""', '"') + "\n"


def _options(system, options):
    """Name, walltime, cores and output of the options of a system; others are taken and have no effect."""
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    names = {
        "slurm": {"name": ["-J", "--job-name"], "walltime": ["-t", "--time"], "cores": ["-c", "--cpus-per-task"]},
        "pbs": {"name": ["-N"]},
        "sge": {"name": ["-N"]},
        "moab": {"name": ["-N"]},
        "lsf": {"name": ["-J"], "walltime": ["-W"], "cores": ["-n"]},
        "oar": {"name": ["-n"]},
        "htcondor": {},
    }[system]
    if system == "slurm":
        names |= {"output": ["-o", "--output"], "error": ["-e", "--error"], "array": ["-a", "--array"]}
    elif system in ("pbs", "sge", "moab", "lsf"):
        names |= {"output": ["-o"], "error": ["-e"]}
    for target in ("name", "walltime", "cores", "output", "error", "array"):
        kind = int if target == "cores" else str
        parser.add_argument(*names.get(target, [f"--no-{target}"]), dest=target, type=kind, default=None)
    parser.add_argument("-l", dest="resources", action="append", default=[])
    known, _ = parser.parse_known_args(options)
    for text in known.resources:
        for key, value in re.findall(r"(walltime|h_rt|ncpus|core)=([^,:]+(?::\d+)*)", text):
            if key in ("walltime", "h_rt"):
                known.walltime = value
            else:
                known.cores = int(value)
    known.cores = known.cores or 1
    return known


def variables_of(wanted, began, end, restarts):
    """Variables that a system sets in its jobs."""
    number, cores = str(wanted["number"]), str(wanted["cores"])
    if wanted["system"] == "slurm":
        known = {"SLURM_JOB_ID": number, "SLURM_CPUS_PER_TASK": cores, "SLURM_NTASKS": "1", "SLURM_PROCID": "0"}
        known |= {"SLURM_JOB_START_TIME": str(int(began)), "SLURM_SUBMIT_DIR": wanted["folder"]}
        known |= {} if end == math.inf else {"SLURM_JOB_END_TIME": str(int(end))}
        known |= {"SLURM_RESTART_COUNT": str(restarts)} if restarts else {}
        if wanted["index"] is not None:
            known |= {"SLURM_ARRAY_JOB_ID": str(wanted["first"]), "SLURM_ARRAY_TASK_ID": str(wanted["index"])}
        return known
    return {
        "pbs": {"PBS_JOBID": f"{number}.headnode", "PBS_O_WORKDIR": wanted["folder"], "NCPUS": cores},
        "moab": {"PBS_JOBID": number, "PBS_O_WORKDIR": wanted["folder"]},
        "sge": {"JOB_ID": number, "NSLOTS": cores, "SGE_O_WORKDIR": wanted["folder"]},
        "lsf": {"LSB_JOBID": number, "LSB_DJOB_NUMPROC": cores},
        "oar": {"OAR_JOB_ID": number, "OAR_WORKDIR": wanted["folder"]},
        "htcondor": {"_CONDOR_SLOT": "slot1"},
    }[wanted["system"]]


def output_files(wanted):
    """Files of stdout and stderr, which systems write into the folder of the submission unless they are told where."""
    system, number, name = wanted["system"], str(wanted["number"]), wanted["name"]
    place = Path(wanted["folder"])
    usual = {
        "slurm": (f"slurm-{number}.out", f"slurm-{number}.out"),
        "pbs": (f"{name}.o{number}", f"{name}.e{number}"),
        "moab": (f"{name}.o{number}", f"{name}.e{number}"),
        "sge": (f"{name}.o{number}", f"{name}.o{number}"),
        "oar": (f"OAR.{number}.stdout", f"OAR.{number}.stderr"),
    }.get(system, (os.devnull, os.devnull))
    found = []
    for told, default in zip((wanted["output"], wanted["error"] or wanted["output"]), usual, strict=True):
        told = told and re.sub("%[jJA]", number, told).replace("%a", str(wanted["index"]))
        path = place / (told or default)
        found.append(path / default if path.is_dir() else path)
    return found
