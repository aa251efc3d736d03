"""Deliberate faults of the plugin, and the force-style tests that catch them: pytest -m benchmark -s, some minutes.

Each fault is one replacement in a copy of the sources, which is built and put in the place of the installed plugin.
"""

import os
import re
import shutil
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest

pytestmark = pytest.mark.benchmark
ROOT = Path(__file__).parents[2]
PAIR, DISKS, BOND, AREA = "pair_circuloline.cpp", "pair_disk_drag.cpp", "bond_line_tension.cpp", "fix_polygon_area.cpp"
DROPLETS = "droplet_drag.cpp"
RANKS = {  # faults that steps as short as those of the force-style tests do not show: a test with long ones
    "fix overdamped of droplets, newton": "test_overdamped_on_ranks.py::test_droplets_flow_alike_on_any_number_of_ranks"
}
FAULTS = {  # name: file, what stands there, what takes its place
    "pair circuloline, sign": (PAIR, "hx - push.fx, -hx}", "hx - push.fx, hx}"),
    "pair circuloline, factor": (PAIR, "law.eps * overlap * law", "2.0 * law.eps * overlap * law"),
    "pair circuloline, ghost": (PAIR, "{push.fy, hy - push.fy", "{push.fy, contact.tail < atom->nlocal ? hy : 0.0"),
    "pair circuloline, newton": (PAIR, "comm->reverse_comm(this);", ""),
    "pair disk/drag, sign": (DISKS, "f[j][1] -= dy * fpair", "f[j][1] += dy * fpair"),
    "pair disk/drag, factor": (DISKS, "fpair = push.force / r", "fpair = 2.0 * push.force / r"),
    "pair disk/drag, ghost": (DISKS, "if (newton_pair || j < nlocal) {", "if (j < nlocal) {"),
    "pair disk/drag, newton": (DISKS, "if (newton_pair || j < nlocal) {", "if (newton_pair) {"),
    "bond line/tension, sign": (BOND, "f[i2][1] -=", "f[i2][1] +="),
    "bond line/tension, factor": (BOND, "gamma[type] * length, fbond", "0.5 * gamma[type] * length, fbond"),
    "bond line/tension, ghost": (BOND, "if (newton_bond || i2 < nlocal) {", "if (i2 < nlocal) {"),
    "bond line/tension, newton": (BOND, "if (newton_bond || i1 < nlocal) {", "if (newton_bond) {"),
    "fix polygon/area, sign": (AREA, "half_pressure = -0.5 *", "half_pressure = 0.5 *"),
    "fix polygon/area, factor": (AREA, "half_pressure = -0.5 *", "half_pressure = -1.0 *"),
    "fix overdamped of disks, sign": ("disk_drag.cpp", "b.spin -= rub * c.arm_j;", "b.spin += rub * c.arm_j;"),
    "fix overdamped of disks, factor": ("disk_drag.cpp", "viscous += part * x", "viscous += 2.0 * part * x"),
    "fix overdamped under stress": ("disk_drag.cpp", "sums[1] += c.share * fx", "sums[1] += 2.0 * c.share * fx"),
    "fix overdamped of disks, ghost": ("disk_drag.cpp", "exchange.add_from_ghosts(out);", ""),
    "fix overdamped of disks, newton": (DISKS, "j < atom->nlocal ? 1.0 : 0.5", "j < atom->nlocal ? 1.0 : 1.0"),
    "fix overdamped of droplets, sign": (DROPLETS, "sums->xx -= stretch", "sums->xx += stretch"),
    "fix overdamped of droplets, factor": (DROPLETS, "torque = 0.5 * m.distance", "torque = m.distance"),
    "fix overdamped of droplets, background": (DROPLETS, "turns[i].drag * p[i].x;", "2.0 * turns[i].drag * p[i].x;"),
    "fix overdamped of droplets, ghost": (DROPLETS, "exchange.add_from_ghosts(out);", ""),
    "fix overdamped of droplets, newton": ("droplet_stiffness.cpp", "lmp->force->newton_bond || j < nlocal", "true"),
}


def build(folder):
    done = subprocess.run(["cmake", "--build", folder, "--target", "jamlabstyles", "jamlabplugin"],
                          capture_output=True, text=True, check=False)  # fmt: skip
    assert done.returncode == 0, done.stdout[-2000:]


def shadow(folder, build):
    """A folder that Python takes for the installed jamlab: LAMMPS keeps the first plugin that brings a style."""
    real = metadata.distribution("jamlab")
    info = folder / f"jamlab-{real.version}.dist-info"
    (folder / "jamlab").mkdir(parents=True, exist_ok=True)
    info.mkdir(exist_ok=True)
    for name in ("METADATA", "entry_points.txt"):
        (info / name).write_text(real.read_text(name))
    for name in ("jamlabkernels.so", "lammps_release"):
        shutil.copy(real.locate_file(f"jamlab/plugin/{name}"), build)
    for name, target in (("plugin", build), ("lammps_inputs", ROOT / "lammps_inputs")):
        if not (folder / "jamlab" / name).exists():
            (folder / "jamlab" / name).symlink_to(target)
    return folder


def caught(folder, tests="test_force_styles.py"):
    """Names of the tests that fail with the jamlab of a folder."""
    line = [sys.executable, "-m", "pytest", "-n", "0", "-q", "--tb=no", "-p", "no:cacheprovider", "-rf",
            *("-m", "slow or not slow"), ROOT / "tests" / "engine" / tests]  # fmt: skip
    path = os.pathsep.join([str(folder), str(ROOT)])
    done = subprocess.run(line, cwd=ROOT, env=os.environ | {"PYTHONPATH": path},
                          capture_output=True, text=True, check=False)  # fmt: skip
    assert "passed" in done.stdout or "failed" in done.stdout, done.stdout[-2000:]
    return re.findall(r"^FAILED .*\[(.*)\]", done.stdout, re.MULTILINE)


def test_every_fault_is_caught(kept_folder):
    source, place = kept_folder / "source", kept_folder / "build"
    shutil.copytree(ROOT / "plugin", source, copy_function=shutil.copyfile, dirs_exist_ok=True)
    (kept_folder / "lammps_inputs").mkdir(exist_ok=True)
    options = ["-DCMAKE_BUILD_TYPE=Debug", f"-DPython_EXECUTABLE={sys.executable}"]
    subprocess.run(["cmake", "-G", "Ninja", "-S", source, "-B", place, *options], check=True, capture_output=True)
    build(place)
    whole = shadow(kept_folder / "shadow", place)
    assert caught(whole) == []
    missed = []
    for name, (file, right, wrong) in FAULTS.items():
        text = (source / file).read_text()
        assert text.count(right) == 1, name
        (source / file).write_text(text.replace(right, wrong))
        build(place)
        found = caught(whole, RANKS.get(name, "test_force_styles.py"))
        print(f"| {name} | {len(found)} | {', '.join(found)} |", flush=True)
        missed += [name] if not found else []
        (source / file).write_text(text)
    assert not missed
