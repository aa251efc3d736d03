"""Signals to whole commands: one line, no process left, no file in part, no port open to others."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
import typer

import jamlab
from jamlab.cli.main import app

CAMPAIGN = 'name = "c"\n[[sweep]]\nname = "disks"\nmodel = "sp"\nn = 64\nseeds = 400\nonset = true\n'
COMMANDS = {
    "demo": ["demo", "--n", "256", "--folder", "out"],
    "campaign": ["campaign", "run", "c.toml", "--workers", "2"],
    "jam": ["jam", "--n", "4096", "--out", "onset.h5"],
    "deck": ["deck", "in.sp.jam", "--n", "4096"],
    "deck on ranks": ["deck", "in.sp.jam", "--n", "4096", "--ranks", "2"],
}
CHILDREN = {"demo": 0, "campaign": 2, "jam": 0, "deck": 1, "deck on ranks": 2}  # in which LAMMPS runs
SAID = {"campaign": "of 400 tasks are finished in c; `jamlab campaign resume c.toml --workers 2` resumes"}


def start(folder, name):
    """A command in a process group of its own, as a shell starts it."""
    (folder / "c.toml").write_text(CAMPAIGN)
    line = [sys.executable, "-m", "jamlab.cli", *COMMANDS[name]]
    checkout = {"PYTHONPATH": os.pathsep.join(sys.path)}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "env": os.environ | checkout}
    caught = {"preexec_fn": lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)}  # as in a terminal
    return subprocess.Popen(line, cwd=folder, text=True, start_new_session=True, **caught, **pipes)


def at_work(process):
    """Whether LAMMPS runs in a process; a campaign's driver never loads it."""
    try:
        return "liblammps" in Path(f"/proc/{process.pid}/maps").read_text()
    except OSError:
        return False


def family_at_work(process, children):
    """The process and its children, as soon as LAMMPS runs in as many of them as are to come."""
    end = time.monotonic() + 120
    while time.monotonic() < end:
        assert process.poll() is None, process.stderr.read()
        family = [psutil.Process(process.pid), *psutil.Process(process.pid).children(recursive=True)]
        if sum(map(at_work, family[1:] if children else family)) >= max(children, 1):
            return family
        time.sleep(0.05)
    raise AssertionError("the work did not begin")


def open_ports(family):
    return {c.laddr.ip for p in family for c in p.net_connections("inet") if c.status == psutil.CONN_LISTEN}


def check_end(folder, name, number, *, group=False):
    process = start(folder, name)
    family = family_at_work(process, CHILDREN[name])
    assert name == "deck on ranks" or open_ports(family) <= {"127.0.0.1", "::1"}  # but mpiexec, for its own ranks
    (os.killpg if group else os.kill)(process.pid, number)
    killed = number == signal.SIGKILL
    within = 30 if killed else 5
    out, err = process.communicate(timeout=within)  # before psutil waits, which would take the exit code
    assert not psutil.wait_procs(family[1:], timeout=within)[1]
    written = [p for p in folder.rglob("*") if p.is_file() and p.suffix in (".h5", ".png", ".html", ".tmp")]
    assert not [p for p in written if p.parent.name != "tasks"]  # finished tasks are whole files
    if killed:
        assert process.returncode == -number
        return
    assert process.returncode == 128 + number
    assert out == ""
    assert err.splitlines()[-1].startswith("interrupted: ") and "Traceback" not in err
    assert SAID.get(name, "nothing was written") in err.splitlines()[-1]


HERE = """
import os, sys, typer.core, jamlab.cli.commands, jamlab.cli.start
def dying(*words, before={where}, **named):
    os.kill(os.getpid(), {number})
    return before(*words, **named)
{where} = dying
sys.argv = ["jamlab", "decks"]
jamlab.cli.start.main()
"""


@pytest.mark.parametrize(
    ("where", "number", "code", "said"),
    [
        ("typer.core.TyperGroup.parse_args", signal.SIGINT, -signal.SIGINT, ""),
        ("typer.core.TyperCommand.invoke", signal.SIGTERM, 128 + signal.SIGTERM, "interrupted: nothing was written\n"),
        ("jamlab.cli.commands._flush", signal.SIGINT, -signal.SIGINT, ""),
    ],
)
def test_a_signal_before_a_command_or_after_it_leaves_no_traceback(where, number, code, said):
    program = HERE.format(where=where, number=int(number))
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (code, said)


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGKILL])
@pytest.mark.parametrize("name", COMMANDS)
def test_no_process_of_any_command_is_left(tmp_path, name, number):
    check_end(tmp_path, name, number)


CAMPAIGN_LOOKS = ("new", "plan", "status", "export", "aggregate")
LONG = {  # commands that keep what is finished when they are interrupted
    "compress": "source.h5 --to 1.0 --step 2e-4",
    "shear": "source.h5 --rate 1e-3 --strain 10",
    "flow-curve": "source.h5 --rate 1 --rate 1e-4 --strain 2",
    "creep": "source.h5 --stress 1e-3 --duration 1e6",
    "oscillate": "source.h5 --omega 1e-3 --amplitude 0.1",
    "relax-stress": "source.h5 --strain 0.05 --duration 1e8",
    "quasistatic-shear": "source.h5 --strain 1 --strain-step 1e-4",
    "stop-flow": "source.h5 --duration 1e8",
}
ALL_OR_NOTHING = {
    "demo",
    "deck",
    "jam",
    "pack",
    "decompress",
    "relax",
    "droplets",
    "estimate",
    "analyze",
    "gstar",
    "explore",
    "convert",
    "anneal",
    "swap-sizes",
    "relax-radii",
}  # one result
TASKS = {"campaign run", "campaign resume"}  # finished tasks are files in a folder
SHORT = {"decks", "doctor", *(f"campaign {k}" for k in CAMPAIGN_LOOKS)}


def test_of_every_command_is_said_what_an_interrupt_keeps():
    def commands(group, *path):
        for name, each in group.commands.items():
            yield from commands(each, *path, name) if hasattr(each, "commands") else [" ".join([*path, name])]

    assert sorted(commands(typer.main.get_command(app))) == sorted([*LONG, *ALL_OR_NOTHING, *TASKS, *SHORT])


@pytest.mark.slow
@pytest.mark.parametrize("name", LONG)
def test_ctrl_c_keeps_what_is_finished(tmp_path, name):
    """After the first save; what is kept can be read, and is more than the start."""
    jamlab.write(tmp_path / "source.h5", jamlab.pack(n=256, pressure=1e-2, seed=1))
    out = tmp_path / "run.h5"
    line = [sys.executable, "-m", "jamlab.cli", name, *LONG[name].split(), "--out", out.name]
    process = subprocess.Popen(line, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    end = time.monotonic() + 120
    while not out.exists() and time.monotonic() < end:
        time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=10)
    said = err.splitlines()[-1]
    assert process.returncode == 130 and said.startswith("interrupted: kept "), err
    assert set(tmp_path.iterdir()) == {out, tmp_path / "source.h5"}
    if name == "compress":
        assert len(jamlab.read_all(out)) > 1
    else:
        found = jamlab.read_flow(out)
        assert found.rate.tolist() == [1.0] if name == "flow-curve" else len(found.time) > 1


def test_ctrl_c_while_the_command_is_imported_shows_no_traceback(tmp_path):
    process, mask, python_caught = start(tmp_path, "jam"), 1 << (signal.SIGINT - 1), False
    end = time.monotonic() + 30
    while time.monotonic() < end:  # until the command has taken SIGINT from Python; if that was missed, it is at work
        caught = int(Path(f"/proc/{process.pid}/status").read_text().split("SigCgt:")[1].split()[0], 16) & mask
        if python_caught and not caught:
            break
        python_caught |= bool(caught)
        time.sleep(1e-3)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=10)
    assert process.returncode in (-signal.SIGINT, 130) and "Traceback" not in err
