"""fix polygon/area in time: energy conserved, ka and rest area from every source."""

import re
from dataclasses import replace

import numpy as np
import outlines
import pytest
from engine.test_plugin_on_ranks import launch

LAST = "write_dump all custom {0}.dump id x y modify sort id format float %.17g\n"
NVE = """
minimize 0 1e-8 400 800
reset_timestep 0
velocity all create 0.002 99 loop geom
velocity all set NULL NULL 0.0
fix move all nve
timestep {step}
thermo_style custom step etotal pe ke f_area
thermo_modify norm no format float %.15g
thermo {every}
run {steps}
"""


def trajectory(folder, state, step, steps):
    """Total, potential, kinetic and area energy along a run; droplets and walls, and the state at its end."""
    (folder / "data").write_text(outlines.data(state))
    deck = outlines.deck("data") + NVE.format(step=step, steps=steps, every=steps // 200)
    code, output = launch(folder, deck + LAST.format("end"), 1)
    assert code == 0, output[-2000:]
    table = output[output.rindex("f_area") :]
    rows = re.findall(r"^\s*\d+((?:\s+[-+.\de]+){4})\s*$", table, re.MULTILINE)
    assert len(rows) == 201
    x = np.loadtxt(folder / "end.dump", skiprows=9)[:, 1:]
    x -= np.round((x - state.points) / state.box) * state.box  # nothing moves by half a box
    points = np.split(x, state.starts[1:-1])
    end = replace(state, outlines=[replace(o, points=p) for o, p in zip(state.outlines, points, strict=True)])
    return np.array([row.split() for row in rows], dtype=float), end


def test_energy_is_conserved_to_second_order(tmp_path):
    """Half the time step, a quarter of the error; at the end, both energies are those of numpy."""
    state = outlines.scene(2, foreign=False)
    spread = []
    for step, steps in ((0.004, 2000), (0.002, 4000)):
        rows, end = trajectory(tmp_path, state, step, steps)
        spread.append(np.ptp(rows[:, 0]))
        of_area = sum(outlines.KA / 2 * (o.area - o.a0) ** 2 for o in end.outlines)
        assert rows[-1, [1, 3]] == pytest.approx([outlines.energy(end), of_area], rel=1e-10)
        assert np.ptp(rows[:, 3]) > 0.001  # the area force is alive
    assert spread[0] < 1e-4 * rows[:, 2].mean()
    assert 3 < spread[0] / spread[1] < 5.5


GLIDE = """
mass * 1e15
group one molecule 1
velocity one set -1.0 0.0 0.0
velocity rings set NULL NULL 0.0
fix move all nve
neigh_modify every 1 delay 0 check no
timestep 0.004
thermo 1
thermo_style custom step pe
thermo_modify norm no format float %.15g
"""


def test_contacts_are_seen_wherever_the_neighbor_list_ends(tmp_path):
    """A tip glides along an edge whose tail comes into the neighbor list."""
    edge = outlines.Outline(np.array([[1.0, 1.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0]]))
    tip = outlines.Outline(np.array([[1.74, 0.8], [1.5, 0.3], [2.0, 0.3]]), a0=0.13)
    assert np.hypot(0.74, 0.2) > np.hypot(0.25, 0.6) + 0.1 > np.hypot(0.70, 0.2)  # the reach of the list
    states = [outlines.Scene([replace(tip, points=tip.points - [0.004 * n, 0]), edge], [6, 6]) for n in range(11)]
    (tmp_path / "data").write_text(outlines.data(states[0]))
    code, output = launch(tmp_path, outlines.deck("data") + GLIDE + "run 10\n", 1)
    assert code == 0, output[-2000:]
    found = re.findall(r"^\s*\d+\s+(\d\.\d{9,})\s*$", output, re.MULTILINE)
    assert [float(pe) for pe in found] == pytest.approx([outlines.energy(s) for s in states], rel=1e-9)
    assert len(outlines.contacts(states[0])) == 1


SOURCES = {
    "number": ("", "20.0"),
    "equal": ("variable k equal 5.0*4", "v_k"),
    "atom": ("variable k atom 20.0+0*mol", "v_k"),
    "property": ("fix stiff all property/atom d_k ghost no\nset group all d_k 20.0", "d_k"),
}


@pytest.mark.parametrize(
    ("define", "ka", "rest"),
    [
        pytest.param(*SOURCES[name], rest, id=f"{name}-{rest}", marks=[pytest.mark.slow] * ((k + j) % 2))
        for k, name in enumerate(SOURCES)
        for j, rest in enumerate(("d_a0", "v_rest"))
    ],
)
def test_ka_and_rest_area_from_every_source(lmp, tmp_path, define, ka, rest):
    """The same energy, with a rest area for each polygon."""
    state = outlines.scene(4)
    law = f"{define}\nvariable rest atom d_a0\nunfix area\nfix area rings polygon/area {ka} {rest}\nrun 0\n"
    outlines.start(lmp, tmp_path, state, law)
    assert lmp.get_thermo("pe") == pytest.approx(outlines.energy(state), rel=1e-12)


LAWS = {"v_none d_a0": "none", "v_text d_a0": "text", "d_none d_a0": "d_none", "v_low d_a0": "-1", "20.0 v_low": "-1"}


@pytest.mark.parametrize(("law", "named"), [*LAWS.items(), ("20.0 v_each", "each")])
def test_a_source_that_makes_no_sense_is_refused(lmp, tmp_path, law, named):
    """Before anything moves."""
    define = "variable text string x\nvariable low equal -1.0\nvariable each atom 1+id\nunfix area\n"
    outlines.start(lmp, tmp_path, outlines.scene(6), define + f"fix area rings polygon/area {law}\n")
    with pytest.raises(Exception, match=named):
        lmp.command("run 0")
