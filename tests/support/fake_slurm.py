"""sbatch, squeue and scancel that run jobs on this machine, and end, refuse, lose and requeue them as a file says.

`install(folder, **faults)` writes them to `folder/bin`; calls of sbatch are counted from 1. Faults: `walltime`, s after
which a job is killed; `refuse`, `lose`, `requeue`: numbers of the jobs that sbatch refuses, that vanish before they
start, and that run again under the same id after their walltime.
"""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path


def install(folder, **faults):
    """Make the commands; returns the folder to put into PATH."""
    (folder / "bin").mkdir(parents=True)
    (folder / "jobs").mkdir()
    (folder / "faults.json").write_text(json.dumps(faults))
    for name in ("sbatch", "squeue", "scancel"):
        words = f"{sys.executable} -S {Path(__file__).resolve()} {name} {folder}"
        (folder / "bin" / name).write_text(f'#!/bin/sh\nexec {words} "$@"\n')
        (folder / "bin" / name).chmod(0o755)
    return folder / "bin"


def sent(folder):
    """How many jobs sbatch was asked for."""
    return len(list(folder.glob("*.asked")))


def sbatch(folder, words, faults):
    if "--test-only" in words:
        return 0
    number = sent(folder) + 1
    (folder / f"{number}.asked").touch()
    if number in faults.get("refuse", ()):
        print("sbatch: error: Batch job submission failed: Job violates accounting/QOS policy", file=sys.stderr)
        return 1
    (folder / f"{number}.sh").write_bytes(Path(words[-1]).read_bytes())
    if number not in faults.get("lose", ()):
        (folder / "jobs" / str(number)).write_text("PD")
        line = [sys.executable, "-S", __file__, "run", folder, str(number)]
        subprocess.Popen(line, start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    print(f"Submitted batch job {number}")
    return 0


def run(folder, words, faults):
    (number,) = words
    entry = folder / "jobs" / number
    for _ in range(1 + (int(number) in faults.get("requeue", ()))):
        with open(folder / f"{number}.log", "w") as log:
            job = subprocess.Popen(["bash", folder / f"{number}.sh"], start_new_session=True, stdout=log, stderr=log)
        entry.write_text(f"R {job.pid}")
        try:
            job.wait(faults.get("walltime"))
        except subprocess.TimeoutExpired:
            entry.write_text("PD")
            os.killpg(job.pid, signal.SIGKILL)
            job.wait()
        if not entry.exists():
            return 0
        time.sleep(0.5)
    entry.unlink(missing_ok=True)
    return 0


def squeue(folder, words, faults):
    for entry in sorted((folder / "jobs").iterdir()):
        print(entry.name, (entry.read_text().split() or ["PD"])[0])
    return 0


def scancel(folder, words, faults):
    for number in words:
        entry = folder / "jobs" / number
        found = entry.read_text().split() if entry.exists() else []
        entry.unlink(missing_ok=True)
        if len(found) == 2:
            os.killpg(int(found[1]), signal.SIGKILL)
    return 0


if __name__ == "__main__":
    name, place, *rest = sys.argv[1:]
    there = Path(place)
    command = {"sbatch": sbatch, "run": run, "squeue": squeue, "scancel": scancel}[name]
    sys.exit(command(there, rest, json.loads((there / "faults.json").read_text())))
