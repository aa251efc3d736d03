"""fix overdamped among other commands of LAMMPS: forces, dumps, computes, minimisations between two flows."""

from pathlib import Path

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


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("fix push all addforce 0.1 0 0", "fix push of style addforce pushes disks too, .* remove it"),
        ("fix move all nve", "fix move of style nve moves atoms, too: unfix it"),
        (
            "pair_style hybrid/overlay disk/drag 1 1 zero 1.0\npair_coeff * * disk/drag 0.5 1\npair_coeff * * zero",
            "pair_style hybrid/overlay pushes disks too",
        ),
    ],
)
def test_other_forces_on_disks_are_refused(tmp_path, disks, lines, message):
    """They moved disks, and entered neither stress nor energy nor steps."""
    with Flow(tmp_path, disks, "rate 1e-2") as flow:
        for line in lines.splitlines():
            flow.lmp.command(line)
        with pytest.raises(Exception, match=message):
            flow.run(1)


def test_bending_of_droplets_is_refused(tmp_path, droplets):
    """No Hessian of it is known: steps that took it as given lost 50 times the work."""
    with DropletFlow(tmp_path, droplets, "rate 1e-2", STOKES) as flow:
        flow.lmp.command("angle_style zero nocoeff")
        with pytest.raises(Exception, match="angle_style zero pushes droplets too"):
            flow.run(1)


def test_fixes_that_push_nothing_are_welcome(tmp_path, disks):
    with Flow(tmp_path, disks, "rate 1e-2 stop 1") as flow:
        for line in ("fix flat all enforce2d", "variable s equal f_flow[2]", "fix mean all ave/time 1 1 1 v_s"):
            flow.lmp.command(line)
        assert flow.run()["strain"] == pytest.approx(1e-2)


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


def test_what_has_no_mass_has_no_kinetic_pressure(tmp_path, disks):
    with Flow(tmp_path, disks, "rate 1e-2 stop 1") as flow:
        for line in ("mass * 1", "velocity all create 1.0 1", "thermo_style custom step press", "thermo 1"):
            flow.lmp.command(line)
        flow.run()
        native = jamlab.evaluate(flow.state())
        assert flow.lmp.get_thermo("press") == pytest.approx(native.pressure, rel=1e-6)


@pytest.mark.parametrize("kind", [Flow, DropletFlow])
def test_a_compute_of_the_fix_that_is_gone_is_named(tmp_path, disks, droplets, kind):
    """It was a segmentation fault."""
    packing, drag = (disks, "1 1") if kind is Flow else (droplets, STOKES)
    with kind(tmp_path, packing, "rate 1e-2", drag) as flow:
        flow.run(1)
        flow.lmp.command("uncompute flow_virial")
        with pytest.raises(Exception, match="compute flow_virial or flow_energy is gone, which belong to it"):
            flow.run(1)
        flow.lmp.command("unfix flow")


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


def test_energy_and_stress_of_droplets_at_the_end_of_a_step(tmp_path, droplets):
    """Forces are those of the prediction: what the correction adds is known to second order."""
    with DropletFlow(tmp_path, droplets, "rate 0.1 longest 0.02 tolerance 1e-3", f"{CONTACT} background 1e-2") as flow:
        flow.run(40)
        before = jamlab.evaluate(flow.state())
        row = flow.run(1)
        after = jamlab.evaluate(flow.state())
    moved = abs(after.energy - before.energy)
    assert row["energy"] * droplets.area == pytest.approx(after.energy, abs=1e-3 * moved)
    assert row["elastic"] == pytest.approx(-after.stress[0, 1], abs=1e-3 * abs(after.stress - before.stress).max())
