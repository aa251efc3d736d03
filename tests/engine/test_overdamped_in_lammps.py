"""fix overdamped among commands of LAMMPS: what it refuses, with value and remedy, and what it goes along with."""

import re
import struct
from pathlib import Path

import numpy as np
import pytest
from disk_flows import Flow
from droplet_flows import CONTACT, STOKES, DropletFlow

import jamlab


@pytest.fixture(scope="module")
def disks():
    return jamlab.pack(n=16, pressure=2e-2, seed=2)


@pytest.fixture(scope="module")
def droplets():
    return jamlab.read(Path(__file__).parents[1] / "states" / "stable_droplets.h5")


def refused(call):
    """What LAMMPS says, without the command itself."""
    with pytest.raises(Exception) as found:
        call()
    return str(found.value).partition("\nLast input line")[0]


@pytest.mark.parametrize("drag", ["1", "1 1 alpha 0.3", "1 1 alpha 1.5", "1 -1", "-1 1", "1 1 arms long"])
def test_drag_law(lmp, drag):
    assert "disk/drag" in (said := refused(lambda: lmp.command(f"pair_style disk/drag {drag}")))
    assert drag == "1" or drag.split()[-1] in said or drag.split()[0] in said


FIXES = ["tolerance 1e-3", "rate 1 stress 1", "rate", "rate 1e999", "oscillate 0 1", "rate 1 tolerance 1"]
FIXES += ["rate 1 solver 0", "rate 1 background -1", "rate 1 fluid -2", "rate 1 speed 2"]
FIXES_OF_DROPLETS = ["rate 1", "rate 1 drag 0 1 1", "rate 1 drag 1 1", "rate 1 drag -1 1 1", "rate 1 drag 1 -1 1"]
FIXES_OF_DROPLETS += ["rate 1 drag 1 1 0.3"]


@pytest.mark.parametrize(
    ("kind", "fix"), [*((Flow, fix) for fix in FIXES), *((DropletFlow, fix) for fix in FIXES_OF_DROPLETS)]
)
def test_words_of_the_fix(tmp_path, disks, droplets, kind, fix):
    """The error names the keyword or the value, or the one that is missing."""

    def start():
        with kind(tmp_path, *((disks, fix) if kind is Flow else (droplets, fix, ""))) as flow:
            flow.run(0)

    said = refused(start)
    assert any(word in said for word in (*fix.split(), "background", "rate"))


HYBRID = "pair_style hybrid/overlay disk/drag 1 1 zero 1.0\npair_coeff * * disk/drag 0.5 1\npair_coeff * * zero"


@pytest.mark.parametrize(
    ("line", "drag", "named"),
    [
        ("pair_style harmonic/cut\npair_coeff * * 0.5 1", "1 1", "disk/drag"),
        ("fix flow all overdamped rate 1", "0 1", "tau = 0"),
        ("group one id 1\nunfix flow\nfix flow one overdamped rate 1", "1 1", "group"),
        ("unfix flow\nchange_box all ortho\nfix flow all overdamped rate 1", "1 1", "triclinic"),
        ("run_style respa 2 2", "1 1", "verlet"),
        # forces that enter neither stress nor energy nor steps
        ("fix push all addforce 0.1 0 0", "1 1", "addforce"),
        ("fix move all nve", "1 1", "nve"),
        ("fix squeeze all deform 1 y erate -0.002 remap x", "1 1", "squeeze of style deform"),
        ("fix squeeze all press/berendsen iso 1 1 1", "1 1", "squeeze of style press/berendsen"),
        (HYBRID, "1 1", "hybrid/overlay"),
        ("unfix area", STOKES, "polygon/area"),
        # no Hessian of it is known: steps that took it as given lost 50 times the work
        ("angle_style zero nocoeff", STOKES, "angle_style"),
        # stresses of droplets are sums that LAMMPS finds when asked
        ("thermo_style custom step\nuncompute thermo_press", STOKES, "thermo_press"),
        (
            "unfix flow\nfix flow all overdamped rate 1 background 1\nunfix area\nfix area all polygon/area 300 d_a0",
            STOKES,
            "define it before",
        ),
        ("fix_modify area virial no", STOKES, "fix_modify area virial yes"),
    ],
)
def test_setting(tmp_path, disks, droplets, line, drag, named):
    kind, packing = (DropletFlow, droplets) if drag == STOKES else (Flow, disks)
    with kind(tmp_path, packing, "rate 1", drag) as flow:
        flow.lmp.commands_list(line.splitlines())
        assert named in refused(lambda: flow.run(1))


@pytest.mark.parametrize(("kind", "drag"), [(Flow, "1 1"), (DropletFlow, CONTACT)])
def test_a_solver_that_does_not_converge_says_what_is_left(tmp_path, disks, droplets, kind, drag):
    """Of droplets, where a flow begins."""
    fix = "rate 1 solver 1e-12 iterations 1"
    with kind(tmp_path, disks if kind is Flow else droplets, fix, drag) as flow:
        said = refused(lambda: flow.run(1))
        assert re.search(r"a residual of \S+ is left after \d iterations", said), said


@pytest.mark.parametrize(("layout", "who"), [(-29.0, "Fix overdamped"), (-4.0, "Pair style disk/drag")])
def test_a_restart_file_of_another_version(tmp_path, disks, layout, who):
    """Those of 0.2.0 have a time where the fix now has its layout, and beta where the pair style has its own."""
    file = tmp_path / "flow.restart"
    with Flow(tmp_path, disks, "rate 1", "1 0.4") as flow:
        flow.run(1)
        flow.lmp.command(f"write_restart {file}")
        ours = struct.pack("d", layout) + (b"" if layout < -4.0 else struct.pack("d", 0.4))
        assert file.read_bytes().count(ours) == 1
        file.write_bytes(file.read_bytes().replace(ours, bytes(8) + ours[8:]))
        again = ["clear", f"read_restart {file}", "fix flow all overdamped rate 1"]
        assert who in refused(lambda: flow.lmp.commands_list(again))


@pytest.mark.parametrize("more", [-8.0, 8.0, -1e3])
def test_a_restart_record_of_another_length(tmp_path, disks, more):
    """Nothing is read beyond it, and nothing is left."""
    file = tmp_path / "flow.restart"
    with Flow(tmp_path, disks, "rate 1 background 1e-2") as flow:
        flow.run(1)
        flow.lmp.command(f"write_restart {file}")
        record, head = file.read_bytes(), struct.pack("d", -29.0)
        length = record.index(head) + 16
        (size,) = struct.unpack_from("d", record, length)
        file.write_bytes(record[:length] + struct.pack("d", size + more) + record[length + 8 :])
        again = ["clear", f"read_restart {file}", "fix flow all overdamped rate 1 background 1e-2"]
        assert f"{size + more:g} bytes of the flow" in refused(lambda: flow.lmp.commands_list(again))


@pytest.mark.parametrize(
    ("fix", "drag", "named"),
    [
        # ghosts reach as far as the longest edge allowed: beyond, contacts would be missed without a word
        pytest.param(
            "rate 30 tolerance 0.1 solver 1e-2 stop 0.05",
            "background 1",
            "1.5",
            marks=pytest.mark.slow,
        ),
        # what no drag holds moves at once; a background drag takes it through
        (
            "rate 0.1 tolerance 0.1 solver 1e-3 stop 0.5",
            CONTACT,
            "background drag is 0",
        ),
    ],
)
def test_flow_of_droplets_that_cannot_go_on(tmp_path, droplets, fix, drag, named):
    with DropletFlow(tmp_path, droplets, fix, drag) as flow:
        assert named in refused(lambda: [flow.run() for _ in range(20)])


def test_a_contact_without_direction_has_no_flow(tmp_path, droplets):
    positions, end = droplets.positions.copy(), droplets.offsets[1]
    apart = np.linalg.norm(positions[:end, None] - positions[end:], axis=2)
    i, j = np.unravel_index(apart.argmin(), apart.shape)
    positions[i] = positions[end + j]
    with DropletFlow(tmp_path, droplets.with_state(positions=positions), "rate 0.1", STOKES) as flow:
        assert "flow-crosses" in refused(lambda: flow.run(0))


def test_fast_flow_without_sliding_drag_survives(tmp_path, disks):
    """B is nearly singular at times: the fastest disk moves at hundreds of times the flow, and steps shrink."""
    with Flow(tmp_path, disks, "rate 0.1 tolerance 0.1 solver 1e-3 stop 1", "1 0") as flow:
        rows = [flow.run() for _ in range(20)]
    assert rows[-1]["strain"] == pytest.approx(2.0)
    assert max(row["energy"] for row in rows) < 0.1


def test_dumps_at_given_times(tmp_path, disks):
    """Steps have any length: LAMMPS must be told of each."""
    path = tmp_path / "flow.dump"
    with Flow(tmp_path, disks, "rate 1e-2 longest 0.07") as flow:
        flow.lmp.command(f"dump rows all custom 100 {path} id x y")
        flow.lmp.command("dump_modify rows every/time 0.5 time yes")
        end = flow.run(60)["time"]
    times = [float(line) for before, line in zip(["", *path.read_text().splitlines()], path.read_text().splitlines(),
                                                 strict=False) if before == "ITEM: TIME"]  # fmt: skip
    assert len(times) == int(end / 0.5) + 1
    for k, time in enumerate(times):
        assert 0.5 * k - 1e-9 <= time < 0.5 * k + 0.08


def test_a_minimisation_between_two_flows_is_a_new_start(tmp_path, droplets):
    """Velocities from before it dragged at first: 2.2e-3 for 9e-6."""
    fix = f"rate 1e-2 {CONTACT} background 1e-2 stop 5"
    with DropletFlow(tmp_path, droplets, fix, "") as flow:
        flow.run()
        flow.lmp.command("minimize 0 1e-10 2000 20000")
        viscous = flow.run(0)["viscous"]
        relaxed = flow.state()
    with DropletFlow(tmp_path, relaxed, fix, "") as flow:
        assert viscous == pytest.approx(flow.run(0)["viscous"], rel=1e-3)


def test_droplets_that_buckle_are_told_from_a_fault(tmp_path, droplets):
    """Pressed by their own areas, their outlines have no stiffness against bending: the matrix of a step has no factor,
    but with more on its diagonal, and the flow ends as that of droplets that slip."""
    pressed = droplets.with_state(params=droplets.params | {"a0": 0.9 * np.asarray(droplets.params["a0"])})
    fix = f"rate 0.01 {CONTACT} background 1e-4 tolerance 1e-2"
    with DropletFlow(tmp_path, pressed, fix, "") as flow, pytest.raises(Exception, match=r"\[flow-slips\]"):
        flow.run(60)
