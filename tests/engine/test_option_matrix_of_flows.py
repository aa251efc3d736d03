"""Flows and disks under combinations of options of LAMMPS: every row of `support/flow_option_table.py`.
`pytest -m slow -s tests/engine/test_option_matrix_of_flows.py` prints how many runs that were, and their time."""

import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from disk_flows import COLUMNS, commands
from droplet_flows import droplet_commands
from flow_option_table import DISKS, FLOWS, FlowRow

import jamlab

from .test_option_matrix import counted, merged
from .test_plugin_on_ranks import launch

pytestmark = pytest.mark.slow
FIX = {"sp": "tolerance 0.1 solver 1e-10 longest 0.01", "dp": "tolerance 0.1 solver 1e-11 longest 0.02"}
COUNTS = {"iterations", "last_iterations"}
SHOW = " ".join(f"$(f_flow[{k}]:%.17g)" for k in range(1, len(COLUMNS) + 1))
END = "\nwrite_dump all custom end.dump id xu yu fx fy modify sort id format float %.17g\n"


@pytest.fixture(scope="module", autouse=True)
def cost(request):
    """How many runs, and their time."""
    yield from counted("rows of flows and disks", request)


@cache
def packing(model):
    """In a box that leans so far that it flips in the first step."""
    if model == "sp":
        found = jamlab.pack(n=64, pressure=1e-2, seed=1)
    else:
        found = jamlab.read(Path(__file__).parents[1] / "states" / "stable_droplets.h5")
    return found.with_state(box=found.box - [[0, 0], found.box[0]], positions=found.positions + 3 * found.box[0])


def flow(folder, row):
    """Numbers of the fix by name, and places."""
    model = row.model
    jamlab.write(folder / "flow.data", packing(model))
    start = commands if model == "sp" else droplet_commands
    given = [*row.options.splitlines(), *row.before.splitlines()]
    head = start(packing(model), "flow.data", newton=row.newton)
    kinds = [line.split()[0] for line in head]
    text = merged("\n".join(head), [line for line in given if line.split()[0] in kinds and line[:3] != "fix"])
    held = "molecule 1" if model == "dp" else "id 1:6"
    lines = [
        *(line for line in given if line.startswith("package") or line.startswith("suffix")),
        *[text, f"group held {held}", "group free subtract all held"],
        *(line for line in given if line.split()[0] not in [*kinds, "package", "suffix"] or line[:3] == "fix"),
        f"fix flow all overdamped {row.fix} {FIX[model]}",
    ]
    again = [line for line in [*text.splitlines(), *lines[-1:]] if line.split()[0] in AGAIN and "property" not in line]
    if model == "dp":
        again.insert(0, "fix d_a0 all property/atom d_a0")
    deck = "\n".join([*lines, row.run.replace("{again}", "\n".join(again)), f'print "row {SHOW}"', END])
    code, output = launch(folder, deck, row.ranks)
    rows = [line.split()[1:] for line in output.splitlines() if line.startswith("row ")]
    assert rows, output[-2500:]
    assert code == 0, output[-2500:]
    places = np.loadtxt(folder / "end.dump", skiprows=9)[:, 1:3]
    return dict(zip(COLUMNS, np.array(rows[0], dtype=float), strict=True)), places


AGAIN = ("fix", "neighbor", "neigh_modify", "thermo_modify")


@cache
def alone(folder, model, fix, before):
    """One rank, newton on, no options."""
    return flow(folder, FlowRow("alone", model, fix, before))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("alone")


@pytest.mark.parametrize("row", FLOWS, ids=lambda row: row.name)
def test_flows(tmp_path, folder, row):
    wanted, there = alone(folder, row.model, row.fix, row.before)
    found, places = flow(tmp_path, row)
    assert wanted["time"] > 0.0
    for name in set(COLUMNS) - COUNTS:
        assert found[name] == pytest.approx(wanted[name], rel=1e-6, abs=1e-12), name
    away = (places - there) @ np.linalg.inv(packing(row.model).box)
    assert np.abs(away - np.round(away)).max() < 1e-8


def table(output):
    """Rows of thermo output."""
    rows = re.findall(r"^ *\d+(?: +[-+.e\d]+)+ *$", output, re.MULTILINE)
    return [float(word) for row in rows for word in row.split()]


SHOWN = 'print "row $(pe:%.17g) $(pxx:%.17g) $(pyy:%.17g) $(pxy:%.17g)"'


@pytest.mark.parametrize("row", DISKS, ids=lambda row: row.name)
def test_disks_are_those_of_harmonic_cut(tmp_path, row):
    jamlab.write(tmp_path / "disks.data", packing("sp"))
    ends = []
    for style in ("disk/drag", "harmonic/cut"):
        head = merged("\n".join(commands(packing("sp"), "disks.data")), row.head.splitlines())
        if style != "disk/drag":
            head = head.replace("pair_style disk/drag 1 1", "pair_style harmonic/cut")
        deck = head + row.lines.replace("{style}", style) + f"\n{SHOWN}{END}"
        code, output = launch(tmp_path, deck, row.ranks, words=row.words)
        assert code == 0, output[-2500:]
        numbers = [line.split()[1:] for line in output.splitlines() if line.startswith("row ")]
        ends.append(
            (np.array(numbers[0], dtype=float), np.loadtxt(tmp_path / "end.dump", skiprows=9)[:, 1:], table(output))
        )
    (ours, places, shown), (theirs, there, same) = ends
    assert ours == pytest.approx(theirs, rel=1e-12)
    assert np.abs(places - there).max() < 1e-11
    assert len(shown) > 1
    assert shown == pytest.approx(same, rel=1e-6, abs=1e-9)
