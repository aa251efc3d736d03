"""What pair_style disk/drag and fix overdamped refuse, each with the value and the remedy."""

import struct

import pytest
from disk_flows import Flow, commands

import jamlab


@pytest.fixture(scope="module")
def packing():
    return jamlab.pack(n=16, pressure=2e-2, seed=2)


@pytest.mark.parametrize(
    ("drag", "message"),
    [
        ("1", "needs: tau beta"),
        ("1 1 alpha 0.3", "alpha 0.3 must lie between 0.4 and 1"),
        ("1 1 alpha 1.5", "alpha 1.5 must lie between 0.4 and 1"),
        ("1 -1", "beta -1 must lie between 0 and 1000000000000"),
        ("-1 1", "tau -1 must be a time"),
        ("1 1 arms long", "arms long is not one of"),
    ],
)
def test_drag_law(lmp, drag, message):
    with pytest.raises(Exception, match=message):
        lmp.command(f"pair_style disk/drag {drag}")


@pytest.mark.parametrize(
    ("fix", "message"),
    [
        ("tolerance 1e-3", "give one of: rate value, oscillate amplitude omega, stress value"),
        ("rate 1 stress 1", "give one of rate, oscillate and stress, not two"),
        ("rate", "rate needs 1 value"),
        ("rate 1e999", "rate 1e999 must be finite|1e999"),
        ("oscillate 0 1", "amplitude 0 and omega 1 of oscillate must be positive"),
        ("rate 1 tolerance 1", "tolerance 1 must lie above 0, up to 0.1"),
        ("rate 1 solver 0", "solver 0 must lie between 1e-13 and 0.1"),
        ("rate 1 background -1", "background -1, .* must not be negative"),
        ("rate 1 fluid -2", "fluid -2, .* must not be negative"),
        ("rate 1 speed 2", "speed is not one of"),
    ],
)
def test_fix(tmp_path, packing, fix, message):
    with pytest.raises(Exception, match=message), Flow(tmp_path, packing, fix):
        pass


@pytest.mark.parametrize(
    ("line", "drag", "message"),
    [
        ("pair_style harmonic/cut\npair_coeff * * 0.5 1", "1 1", "needs pair_style disk/drag"),
        ("fix flow all overdamped rate 1", "0 1", "no drag at all: tau = 0 of pair_style disk/drag needs a background"),
        ("group one id 1\nunfix flow\nfix flow one overdamped rate 1", "1 1", "group must be all"),
        ("unfix flow\nchange_box all ortho\nfix flow all overdamped rate 1", "1 1", "periodic triclinic box"),
        ("run_style respa 2 2", "1 1", "run_style verlet only"),
    ],
)
def test_setting(tmp_path, packing, line, drag, message):
    with Flow(tmp_path, packing, "rate 1", drag) as flow:
        for command in line.splitlines():
            flow.lmp.command(command)
        with pytest.raises(Exception, match=message):
            flow.run(1)


def test_a_solver_that_does_not_converge_says_what_is_left(tmp_path, packing):
    with Flow(tmp_path, packing, "rate 1 solver 1e-12 iterations 3") as flow:
        with pytest.raises(Exception, match=r"a residual of .* is left after 3 iterations: give a background drag"):
            flow.run(1)


@pytest.mark.parametrize(("layout", "who"), [(-17.0, "Fix overdamped"), (-1.0, "Pair style disk/drag")])
def test_a_restart_file_of_another_version(tmp_path, packing, layout, who):
    """Those of 0.2.0 have a time where the fix now has its layout, and beta where the pair style has its own."""
    file = tmp_path / "flow.restart"
    with Flow(tmp_path, packing, "rate 1", "1 0.4") as flow:
        flow.run(1)
        flow.lmp.command(f"write_restart {file}")
        ours = struct.pack("d", layout) + (b"" if layout < -1.0 else struct.pack("d", 0.4))
        assert file.read_bytes().count(ours) == 1
        file.write_bytes(file.read_bytes().replace(ours, bytes(8) + ours[8:]))
        with pytest.raises(Exception, match=f"{who}: the restart file was written by another version"):
            flow.lmp.commands_list(["clear", f"read_restart {file}", "fix flow all overdamped rate 1"])


def test_disks_in_one_place_are_refused(lmp, tmp_path, packing):
    jamlab.write_data(tmp_path / "flow.data", packing)
    for line in [*commands(packing, str(tmp_path / "flow.data")), "displace_atoms all ramp x 0 0 y 0 1"]:
        lmp.command(line)
    lmp.command("set atom 1*2 x 0 y 0")
    with pytest.raises(Exception, match="are in one place, where their contact has no direction"):
        lmp.command("run 0")


def test_fast_flow_without_sliding_drag_survives(tmp_path, packing):
    """B is nearly singular at times: the fastest disk moves at hundreds of times the flow, and steps shrink."""
    with Flow(tmp_path, packing, "rate 0.1 tolerance 0.1 solver 1e-3 stop 1", "1 0") as flow:
        rows = [flow.run() for _ in range(20)]
    assert rows[-1]["strain"] == pytest.approx(2.0)
    assert max(row["energy"] for row in rows) < 0.1
