"""What a process loads for its first results: slow libraries wait until something needs them."""

import subprocess
import sys

import pytest

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
    told = "\nprint(*sys.modules)\n"
    lines = f"import sys, jamlab\n{FLOW.format(path=str(path))}{told}{OTHERS}{told}"
    found = subprocess.run([sys.executable, "-W", "ignore", "-c", lines], capture_output=True, text=True, timeout=300)
    assert found.returncode == 0, found.stderr
    return [set(line.split()) for line in found.stdout.splitlines()]


def test_flow_of_disks_loads_no_scipy(loaded):
    assert not loaded[0].intersection(NEVER)
    assert not {name for name in loaded[0] if name.partition(".")[0] == "scipy"}


def test_first_packing_and_its_measures_load_what_they_need(loaded):
    assert len(loaded) == 2 and "scipy" in loaded[1] and not loaded[1].intersection(NEVER)
