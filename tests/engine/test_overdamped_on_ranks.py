"""Plain `lmp` under MPI: the same flow on any number of ranks, newton on or off, over a flip of the box."""

from pathlib import Path

import numpy as np
import pytest
from disk_flows import COLUMNS, commands
from droplet_flows import droplet_commands

import jamlab

from .test_body_forces import DOWN, HEAD, KINDS, WEIGHT, falling
from .test_plugin_on_ranks import launch

FIX = {
    "sp": "tolerance 0.1 solver 1e-10 longest 0.01",
    "dp": "tolerance 0.1 solver 1e-11 longest 0.02 drag 1 1 1 background 5",
}
LAWS = {"adhesion": 0.01, "adhesion_range": 0.2, "kappa": 0.05, "theta0": 0.5, "kp": 1.0, "kl": 0.5, "p0": 3.7}
PRINT = " ".join(f"$(f_flow[{k}]:%.17g)" for k in range(1, len(COLUMNS) + 1))


def flow(folder, packing, ranks, newton, steps=80, grid="1 * 1", more="", drive="rate 1", tiles=()):
    """Numbers of the fix at the end of a run, by name."""
    jamlab.write(folder / "flow.data", packing)
    start = commands if packing.model == "sp" else droplet_commands
    lines = [
        *start(packing, "flow.data", newton=newton, grid=grid),
        *tiles,
        f"fix flow all overdamped {drive} {FIX[packing.model]} {more}",
    ]
    code, output = launch(folder, "\n".join([*lines, f"run {steps}", f'print "row {PRINT}"']) + "\n", ranks)
    rows = [row.split()[1:] for row in output.splitlines() if row.startswith("row ")]
    assert code == 0 or not rows, output
    return dict(zip(COLUMNS, np.array(rows[0], dtype=float), strict=True)) if rows else output


@pytest.fixture(scope="module")
def packing():
    """In a box that leans so far that it flips in the first step."""
    found = jamlab.pack(n=64, pressure=1e-2, seed=1)
    return found.with_state(box=found.box - [[0, 0], found.box[0]], positions=found.positions + 260 * found.box[0])


@pytest.mark.parametrize(
    ("ranks", "newton", "steps"),
    [
        (2, "on", 3),
        (1, "off", 36),  # some pairs rub, of which one rank has both halves
        *(pytest.param(2, newton, 80, marks=pytest.mark.slow) for newton in ("on", "off")),
        pytest.param(4, "on", 4, marks=pytest.mark.slow),
        pytest.param(4, "off", 4, marks=pytest.mark.slow),
    ],
)
@pytest.mark.parametrize("more", ["", pytest.param("background 1e-4", marks=pytest.mark.slow)])  # alone, with factors
def test_the_flow_is_the_same_on_any_number_of_ranks(tmp_path, packing, ranks, newton, steps, more):
    alone = flow(tmp_path, packing, 1, "on", steps, more=more)
    found = flow(tmp_path, packing, ranks, newton, steps, more=more)
    assert steps < 80 or found["strain"] > 0.1
    for name in set(COLUMNS) - {"iterations", "last_iterations"}:
        assert found[name] == pytest.approx(alone[name], rel=1e-6), name


@pytest.mark.parametrize("ranks", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_tiles_change_nothing(tmp_path, packing, ranks):
    """Of recursive bisection, as many along x as there are ranks; the box flips in the first step."""
    tiles = ["comm_style tiled", "run 0", "balance 1.0 rcb"]
    alone, found = flow(tmp_path, packing, 1, "on", 3), flow(tmp_path, packing, ranks, "on", 3, "* * 1", tiles=tiles)
    for name in set(COLUMNS) - {"iterations", "last_iterations"}:
        assert found[name] == pytest.approx(alone[name], rel=1e-6), name


@pytest.fixture(scope="module")
def droplets():
    """Eight, that flip in the first step, and go back by 260 boxes; every rank has parts of most."""
    found = jamlab.read(Path(__file__).parents[1] / "states" / "stable_droplets.h5")
    return found.with_state(box=found.box - [[0, 0], found.box[0]], positions=found.positions + 260 * found.box[0])


@pytest.mark.parametrize(
    ("ranks", "newton", "steps", "drive"),
    [
        (2, "off", 2, "rate 0.1"),
        (2, "off", 2, "stress 0.01"),
        (2, "on", 2, "rate 0.1 fixed held"),
        pytest.param(2, "off", 45, "rate 0.1", marks=pytest.mark.slow),
        pytest.param(2, "on", 45, "rate 0.1", marks=pytest.mark.slow),
        pytest.param(1, "off", 45, "rate 0.1", marks=pytest.mark.slow),
        pytest.param(4, "on", 6, "rate 0.1", marks=pytest.mark.slow),
        pytest.param(4, "off", 6, "rate 0.1", marks=pytest.mark.slow),
    ],
)
@pytest.mark.parametrize("laws", [{}, LAWS])
@pytest.mark.slow
def test_droplets_flow_alike_on_any_number_of_ranks(tmp_path, droplets, ranks, newton, steps, drive, laws):
    """Though every rank has factors of its own part of the drag."""
    held = ["group held molecule 1 4"]
    droplets = droplets.with_state(params=droplets.params | laws)
    alone = flow(tmp_path, droplets, 1, "on", steps, drive=drive, tiles=held)
    found = flow(tmp_path, droplets, ranks, newton, steps, drive=drive, tiles=held)
    for name in set(COLUMNS) - {"iterations", "last_iterations"}:
        assert found[name] == pytest.approx(alone[name], rel=1e-6), name


@pytest.mark.slow
@pytest.mark.parametrize("model", ["sp", "dp"])
@pytest.mark.parametrize("newton", ["on", "off"])
def test_bodies_fall_alike_on_two_ranks(tmp_path, packing, droplets, model, newton):
    """On held ones; the box flips first."""
    down = ["fix weight all gravity 1e-3 vector 1 -1 0", "group held id 1:20", "group push id 30:50"]
    down += ["fix wind push addforce 1e-3 0 0"]
    rows = [
        flow(tmp_path, droplets if model == "dp" else packing, ranks, newton, 20, tiles=down, drive="rate 0.1",
             more="fixed held background 0.1" if model == "sp" else "")
        for ranks in (1, 2)
    ]  # fmt: skip
    assert rows[0]["work"] != 0.0
    for name in set(COLUMNS) - {"iterations", "last_iterations"}:
        assert rows[1][name] == pytest.approx(rows[0][name], rel=1e-6), name


def test_a_rank_without_droplets_goes_on_with_the_others(tmp_path):
    """The upper half of the box is empty; whether a solution has converged, all ranks say alike."""
    lines = [*HEAD.splitlines(), *falling("droplets", tmp_path), DOWN.format(WEIGHT["droplets"])]
    fix = f"fix flow all overdamped rate 0 fixed held {KINDS['droplets']} solver 1e-11"
    rows = []
    for ranks in (1, 2):
        code, output = launch(tmp_path, "\n".join([*lines, fix, "run 5", f'print "row {PRINT}"']) + "\n", ranks, 60)
        assert code == 0, output
        rows += [row.split()[1:] for row in output.splitlines() if row.startswith("row ")]
    counted = [COLUMNS.index(name) for name in ("iterations", "last_iterations")]
    one, two = (np.delete(np.array(row, dtype=float), counted) for row in rows)
    assert two == pytest.approx(one, rel=1e-6, abs=1e-12)


@pytest.mark.slow
def test_ranks_side_by_side_that_a_flip_would_skip_are_refused(tmp_path, packing):
    output = flow(tmp_path, packing, 4, "on", 1, "4 1 1")
    assert "4 ranks side by side along x" in output
