"""Droplets, walls and disks under combinations of options of LAMMPS: every row of `support/option_table.py`, against
plain numpy. `pytest -m slow -s tests/engine/test_option_matrix.py` prints how many runs that were, and their time."""

import resource
import time
from dataclasses import replace
from functools import cache

import numpy as np
import option_table
import outline_law_table
import outlines
import pytest
from folded_outlines import folded
from option_table import AGAIN, HEAD, STEP, STEPS
from plain_forces import evaluate, read_dump, state_of, verlet

from .test_one_path import few_droplets
from .test_plugin_on_ranks import launch

pytestmark = pytest.mark.slow
END = """
write_dump all custom end.dump id mol type xu yu fx fy d_a0 modify sort id format float %.17g
print "row $(pe:%.17g) $(evdwl:%.17g) $(ebond:%.17g) $(c_virial[1]*vol:%.17g) $(c_virial[2]*vol:%.17g)&
 $(c_virial[4]*vol:%.17g)"
"""
NKTV2P = {"real": 68568.415, "metal": 1.6021765e6, "electron": 2.94210108e13}  # of LAMMPS, where it is not 1


@pytest.fixture(scope="module", autouse=True)
def cost(request):
    """How many runs, and their time."""
    yield from counted("rows of droplets", request)


def counted(what, request):
    """Printed once a file is done."""
    began, used = time.time(), resource.getrusage(resource.RUSAGE_CHILDREN)
    yield
    done = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = done.ru_utime + done.ru_stime - used.ru_utime - used.ru_stime
    runs = sum(item.module is request.module for item in request.session.items)
    print(f"\n{runs} {what}: {cpu:.0f} s of CPU time of LAMMPS, {time.time() - began:.0f} s in all")


# scenes and decks ----------------------------------------------------------------------------------------------------


def wide():
    """Flat droplets that meet their own images and each other on both sides."""
    along, up = np.linspace(0, 1, 8, endpoint=False), np.linspace(0, 1, 3, endpoint=False)
    sides = ([along, 0 * along], [1 + 0 * up, up], [1 - along, 1 + 0 * along], [0 * up, 1 - up])
    ring = np.concatenate([np.column_stack(side) for side in sides]) * [1.7, 0.5]
    rng = np.random.default_rng(1)
    middles = [(0.31 * k - 0.4, 0.62 * k - 0.3) for k in range(3)]
    rings = [outlines.Outline(ring + middle + rng.uniform(-0.03, 0.03, ring.shape), a0=0.8) for middle in middles]
    return outlines.Scene(rings, np.array([1.84, 1.88]))


def with_lines():
    """Flat walls in the place of the chain; one meets vertices at both edges of the box."""
    scene = outlines.scene(3)
    lines = [outlines.Outline(np.array([[x, y]]), outlines.WALL) for x, y in ((0.4, 0.05), (4.9, 3.9))]
    return replace(scene, outlines=[*scene.outlines[:-1], *lines])


def closed():
    """Away from the edges of a wider box."""
    scene = outlines.scene(6)
    return replace(scene.shifted(0.5 - scene.points.min(axis=0)), box=scene.box + 2.5)


SCENES = {
    "all": lambda: outlines.scene(6),
    "droplets": lambda: few_droplets(6),
    "folded": folded,
    "flat": with_lines,
    "wide": wide,
    "closed": closed,
}


@cache
def start(name):
    """Scene, data file with velocities, and these."""
    scene = SCENES[name]()
    velocities = np.random.default_rng(8).normal(0.0, 0.2, scene.points.shape)
    lines = [f"{k} {x:.17g} {y:.17g} 0" for k, (x, y) in enumerate(velocities, start=1)]
    return scene, outlines.data(scene) + "\n".join(["\nVelocities\n", *lines, ""]), velocities


def key(line):
    """Lines with one key take each other's place."""
    words = line.split()
    return words[: 2 if words[0] == "fix" else 1]


def merged(text, own):
    """Lines of a text, in which each of one's own replaces the line of its kind."""
    found, kinds = [], []
    for line in text.splitlines():
        mine = [one for one in own if key(one) == key(line)]
        if key(line) not in kinds:
            found += mine or [line]
        elif not mine:
            found.append(line)
        kinds.append(key(line))
    return "\n".join(found) + "\n"


def deck(row):
    """All commands."""
    own = row.head.splitlines()
    standard = [key(line) for line in (HEAD + AGAIN).splitlines()]
    first = "".join(f"{line}\n" for line in own if key(line) not in standard)
    head, again = first + merged(HEAD, own), merged(AGAIN, own) + row.after
    ends = "run " in row.lines or "minimize " in row.lines
    body = row.lines + ("\n" if ends else f"\nrun {STEPS}\n")
    for name, text in {
        "{head}": head,
        "{head:kept}": head.replace("read_data data", "read_data kept"),
        "{again}": again,
        "{thermo}": "\n".join(line for line in again.splitlines() if line.startswith("thermo")),
    }.items():
        body = body.replace(name, text)
    return head + again + body


# what must hold ------------------------------------------------------------------------------------------------------


def ended(folder, row):
    """State, forces and numbers where the lines end."""
    (folder / "data").write_text(start(row.scene)[1])
    code, output = launch(folder, deck(row) + END, row.ranks, words=row.words)
    assert code == 0, output[-3000:]
    numbers = [line.split()[1:] for line in output.splitlines() if line.startswith("row ")]
    return *read_dump(folder / "end.dump"), np.array(numbers[0], dtype=float), output


def check(row, state, forces, numbers):
    """Forces, energies and virial against plain numpy."""
    units = next((line.split()[1] for line in row.head.splitlines() if line.startswith("units")), "lj")
    found = evaluate(state, row.law)
    scale = max(1.0, np.abs(found.forces).max())
    assert np.abs(found.forces).max() > 0.01
    assert np.abs(forces - found.forces).max() < 1e-12 * scale
    energies = [sum(found.energy.values()), found.energy["pair"], found.energy["bond"]]
    assert np.abs(numbers[:3] - energies).max() < 1e-12 * max(energies[0], 1.0)
    virial = sum(found.virial.values())
    assert np.abs(numbers[3:] / NKTV2P.get(units, 1.0) - virial).max() < 1e-12 * max(np.abs(virial).max(), 1.0)


@cache
def path(scene, law):
    """Where plain numpy ends."""
    scene, _, velocities = start(scene)
    return verlet(state_of(scene), velocities, law, STEP, STEPS)


PATHS = [*option_table.PATHS, *outline_law_table.PATHS]
STATES = [*option_table.STATES, *outline_law_table.STATES]
REFUSALS = [*option_table.REFUSALS, *outline_law_table.REFUSALS]


@pytest.mark.parametrize("row", PATHS, ids=lambda row: row.name)
def test_paths_forces_and_energies(tmp_path, row):
    state, forces, numbers, _ = ended(tmp_path, row)
    check(row, state, forces, numbers)
    away = state.points - path(row.scene, row.law)
    away -= np.round(away / np.diag(state.box)) * np.diag(state.box)
    assert np.abs(away).max() < 1e-11


@pytest.mark.parametrize("row", STATES, ids=lambda row: row.name)
def test_forces_and_energies(tmp_path, row):
    check(row, *ended(tmp_path, row)[:3])


@pytest.mark.parametrize("row", REFUSALS, ids=lambda row: row.name)
def test_refusals(tmp_path, row):
    (tmp_path / "data").write_text(start(row.scene)[1])
    code, output = launch(tmp_path, deck(row), row.ranks)
    errors = [line for line in output.splitlines() if line.startswith("ERROR")]
    assert code and any(row.said in line for line in errors), output[-1500:]


def test_no_row_stands_twice():
    rows = [*PATHS, *STATES, *REFUSALS]
    assert len({row.name for row in rows}) == len(rows)
