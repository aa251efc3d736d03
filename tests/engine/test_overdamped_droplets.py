"""fix overdamped over droplets: against the frequency domain and native forces; energy, box, files, what is refused."""

from pathlib import Path

import numpy as np
import pytest
from droplet_drag import drag_stress
from droplet_flows import CONTACT, STOKES, DropletFlow

import jamlab

LAWS = {CONTACT: jamlab.ContactDamping(), STOKES: jamlab.StokesDrag(eta_f=0.0)}


@pytest.fixture(scope="module")
def packing():
    """Eight droplets of the default law at rho = 0.92, stable under shear: `jam(8, "dp", 3)`, shear-stabilized."""
    return jamlab.read(Path(__file__).parents[1] / "states" / "stable_droplets.h5")


@pytest.mark.parametrize(("drag", "newton"), [(CONTACT, "on"), (STOKES, "off")])
def test_stress_of_a_step_in_rate_is_the_fast_limit(tmp_path, packing, drag, newton):
    """0 for both: vertices move so that no contact slides, and Stokes drag has no part in the affine flow."""
    limit = jamlab.complex_modulus(packing, [1.0], LAWS[drag]).eta_inf
    native = jamlab.evaluate(packing)
    with DropletFlow(tmp_path, packing, "rate 0.01 solver 1e-10", drag, newton) as flow:
        row = flow.run(0)
        assert flow.forces() == pytest.approx(native.forces, abs=1e-12)
    assert row["viscous"] / 0.01 == pytest.approx(limit, abs=1e-9)
    assert row["elastic"] == pytest.approx(-native.stress[0, 1], abs=1e-13)
    assert row["pressure"] == pytest.approx(native.pressure, rel=1e-9)
    assert row["energy"] * packing.area == pytest.approx(native.energy, rel=1e-12)


def test_drag_is_the_matrix_of_the_frequency_domain(tmp_path, packing):
    """Viscous stress and balance of forces at the velocities of a flow, by B of the drag law; the pressure and the
    normal stress by plain sums, torques of the drag included."""
    with DropletFlow(tmp_path, packing, "rate 0.3 solver 1e-9 longest 1e-3", "drag 1 0.3 1 background 0.2") as flow:
        first, start = flow.run(60), flow.state()
        row, end = flow.run(1), flow.state()
    dt = row["time"] - first["time"]
    moved = end.positions - start.positions
    moved[:, 0] -= 0.3 * dt * 0.5 * (start.positions + end.positions)[:, 1]
    rates = np.append(moved / dt, 0.3)
    middle = start.with_state(positions=0.5 * (start.positions + end.positions), box=0.5 * (start.box + end.box))
    drag = jamlab.dynamical_matrices(middle, jamlab.ContactDamping(beta=0.3))[1] @ rates
    share = 0.2 / np.bincount(packing.particle)[packing.particle]
    forces = jamlab.evaluate(middle).forces
    mean = {name: 0.5 * (first[name] + row[name]) for name in row}
    assert drag[-1] / packing.area == pytest.approx(mean["viscous"], rel=1e-3)
    assert drag[:-1].reshape(-1, 2) + share[:, None] * moved / dt == pytest.approx(forces, abs=1e-3 * abs(drag).max())
    plain = drag_stress(middle, moved / dt, 0.3, 0.3)
    tension, size = plain - jamlab.evaluate(middle).stress, 1e-3 * np.abs(plain).max()
    assert mean["viscous"] == pytest.approx(plain[0, 1], abs=size)
    assert mean["pressure"] == pytest.approx(-0.5 * np.trace(tension), abs=size)
    assert mean["normal_stress_difference"] == pytest.approx(tension[0, 0] - tension[1, 1], abs=size)


def test_a_row_is_of_the_end_of_its_step(tmp_path, packing):
    """Pressure and normal stress follow from the positions, since Stokes drag has no part in them; the next run begins
    with the same row, whose elastic stress is evaluated there."""
    with DropletFlow(tmp_path, packing, "rate 0.02 stop 2.5", STOKES) as flow:
        row, end = flow.run(), jamlab.evaluate(flow.state())
        again = flow.run(0)
    assert row["pressure"] == pytest.approx(end.pressure, rel=1e-4)
    difference = end.stress[1, 1] - end.stress[0, 0]
    assert row["normal_stress_difference"] == pytest.approx(difference, abs=1e-4 * end.pressure)
    assert all(again[name] == row[name] for name in ("pressure", "viscous", "dissipation"))
    assert again["elastic"] == pytest.approx(row["elastic"], rel=1e-4)


class SecondType(DropletFlow):
    """All bonds are of a second type; the first has another tension."""

    def lines(self, data, drag, newton):
        lines = [line.replace("nocoeff", "nocoeff extra/bond/types 1") for line in super().lines(data, drag, newton)]
        return [*lines, "bond_coeff 1 9.0 0.5", "set group all bond 2"]


def test_every_bond_has_the_tension_of_its_type(tmp_path, packing):
    rows = []
    for kind in (DropletFlow, SecondType):
        with kind(tmp_path, packing, "rate 0.1 tolerance 1e-2 solver 1e-8", STOKES) as flow:
            row = flow.run(20)
        rows.append({name: value for name, value in row.items() if not name.endswith("iterations")})
    assert rows[1] == pytest.approx(rows[0], rel=1e-6)


def test_split_and_restarted_runs_are_one_run(tmp_path, packing):
    fix = "rate 0.1 solver 1e-10 " + CONTACT
    with DropletFlow(tmp_path, packing, fix, "") as flow:
        whole = flow.run(60)
    assert whole["iterations"] < 9 * 60  # factors of the matrix are its preconditioner
    with DropletFlow(tmp_path, packing, fix, "") as flow:
        flow.run(43)
        flow.lmp.command(f"write_restart {tmp_path}/half.restart")
        split = flow.run(17)
        law = packing.params
        for line in (
            *("clear", f"read_restart {tmp_path}/half.restart", "fix d_a0 all property/atom d_a0"),
            *("special_bonds lj/coul 1.0 1.0 1.0", "neigh_modify every 1 delay 0 check yes"),
            *(f"fix area all polygon/area {law['ka']:.17g} d_a0", f"fix flow all overdamped {fix}"),
        ):
            flow.lmp.command(line)
        again = flow.run(17)
    for name in ("time", "strain", "stress", "viscous", "energy", "work", "dissipated", "step"):
        assert split[name] == pytest.approx(whole[name], rel=1e-6), name
        assert again[name] == pytest.approx(whole[name], rel=1e-6), name
