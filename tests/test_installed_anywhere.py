"""jamlab installed and used in folders of any name, by anybody: each kind runs, or is refused by name.

Every kind is an environment of its own, into which this checkout is installed: minutes, and the registry of packages.
"""

import os
import pwd
import shutil
import subprocess
import sys
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

ROOT = Path(__file__).parents[1]
ODD = "ä b'中"  # a folder or a file of somebody whose language is not English
CAMPAIGN = """
name = "small"
[[sweep]]
name = "disks"
model = "sp"
n = [8]
seeds = 2
compress = { to = 0.9, step = 0.05 }
observables = ["states"]
"""
# environment's folder, working folder, name of files, settings of the shell
KINDS = {
    "umlaut": ("my päckings dir", "work", "run", {}),
    "space": ("my packings", "work", "run", {}),
    "chinese": ("中文", "work", "run", {}),
    "apostrophe": ("it's", "work", "run", {}),
    "quotation mark": ('say "so"', "work", "run", {}),
    "dollar": ("a $HOME#&%1", "work", "run", {}),
    "long": ("l" * 200, "work", "run", {}),
    "odd work": ("plain", ODD, ODD, {"TMPDIR": ODD, "HOME": ODD}),
    "long files": ("plain", "w" * 200, "f" * 200, {"HOME": "/nonexistent"}),
    "dash": ("-e", "-w", "./-f", {"TMPDIR": "-t"}),
    "umask": ("private", "work", "run", {"umask": "077"}),
}

pytestmark = pytest.mark.slow


def shell(line, folder, settings):
    """Run a line of the shell in a folder, with settings of its environment; paths among them become absolute."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"} | settings
    umask = environment.pop("umask", "022")
    return subprocess.run(["bash", "-c", f"umask {umask}; {line}"], cwd=folder, env=environment, capture_output=True,
                          text=True, check=False)  # fmt: skip


def installed(folder, settings):
    """Install this checkout into a new environment of a folder; the folder of its commands."""
    folder.mkdir(parents=True)
    quick = shutil.which("uv")
    python = '"$PWD/.venv/bin/python"'
    make = f'uv venv -q --python "{sys.executable}" .venv' if quick else f'"{sys.executable}" -m venv .venv'
    get = f"uv pip install -q --python {python}" if quick else f"{python} -m pip install -q"
    done = shell(f'{make} && {get} "{ROOT}"', folder, settings)
    assert done.returncode == 0, done.stderr
    return folder / ".venv" / "bin"


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """Commands of an environment that several kinds share."""
    return installed(tmp_path_factory.mktemp("plain") / "environment", {})


@pytest.fixture(params=KINDS)
def scene(request, tmp_path):
    """Commands, working folder, name of files and settings of a kind."""
    place, work, name, settings = KINDS[request.param]
    made = {key: str(tmp_path / value) if key in ("TMPDIR", "HOME") else value for key, value in settings.items()}
    for folder in (tmp_path / work, *(Path(made[key]) for key in ("TMPDIR", "HOME") if key in made)):
        if folder.parent == tmp_path:
            folder.mkdir(exist_ok=True)
    own = {"umask": settings["umask"]} if "umask" in settings else {}
    commands = request.getfixturevalue("plain") if place == "plain" else installed(tmp_path / place, own)
    return commands, tmp_path / work, name, made


USES = {
    "demo": ['jamlab demo --n 8 --to 0.9 --folder "$NAME"'],
    "deck": ["jamlab deck in.sp.jam --n 8", "jamlab deck in.dp.jam --n 8", "jamlab deck in.sp.pressure --n 8"],
    "campaign": ['jamlab campaign run "$NAME.toml" --workers 2', 'jamlab campaign status "$NAME.toml"'],
    "restart": [
        'jamlab pack --n 16 --pressure 1e-2 --seed 1 --out "$NAME.h5"',
        'jamlab shear "$NAME.h5" --rate 0.01 --strain 0.02 --out "$NAME.run.h5"',
        'jamlab shear "$NAME.h5" --rate 0.01 --strain 0.02 --out "$NAME.run.h5"',
        'jamlab campaign resume "$NAME.toml"',
    ],
}


def test_every_use_works_or_is_refused_by_name(scene):
    commands, work, name, settings = scene
    (work / f"{name}.toml").write_text(CAMPAIGN)
    settings = settings | {"NAME": name, "PATH": f"{commands}:{os.environ['PATH']}"}
    for use, lines in USES.items():
        for line in lines:
            done = shell(line, work, settings)
            if use == "deck" and '"' in str(commands):  # LAMMPS cannot quote it
                assert done.returncode == 1 and "jamlab decks --copy" in done.stderr
            else:
                assert done.returncode == 0, f"{use}: {line}: {done.stdout[-500:]}{done.stderr}"


@pytest.mark.skipif(os.geteuid() != 0, reason="only the administrator can act as somebody else")
def test_another_user_runs_what_nobody_can_write():
    who = pwd.getpwnam("nobody")
    me = {"user": who.pw_uid, "group": who.pw_gid, "extra_groups": []}
    try:
        subprocess.run([Path(sys.executable).resolve(), "-c", ""], check=True, cwd="/", **me)
    except (PermissionError, subprocess.CalledProcessError):
        pytest.skip(f"others cannot run {Path(sys.executable).resolve()}")
    with TemporaryDirectory() as folder:  # not in that of pytest, which lets nobody else in
        top, work = Path(folder), Path(folder) / "work"
        top.chmod(0o755)
        commands = installed(top / "environment", {"UV_LINK_MODE": "copy"})
        for path in (top / "environment").rglob("*"):
            if not path.is_symlink():
                path.chmod(path.stat().st_mode & ~0o222)
        work.mkdir()
        (work / "run.toml").write_text(CAMPAIGN)
        os.chown(work, who.pw_uid, who.pw_gid)
        settings = {"PATH": f"{commands}:{os.environ['PATH']}", "NAME": "run", "HOME": "/nonexistent"}
        for line in chain.from_iterable(USES.values()):
            done = subprocess.run(["bash", "-c", line], cwd=work, env=settings, capture_output=True, text=True,
                                  check=False, **me)  # fmt: skip
            assert done.returncode == 0, f"{line}: {done.stdout[-500:]}{done.stderr}"
