"""fix overdamped: massless disks under shear, against the frequency domain and a dense integrator; box and files."""

import numpy as np
import pytest
from disk_flows import Flow

import jamlab
from jamlab.flow.overdamped_session import OverdampedSession


@pytest.fixture(scope="module")
def packing():
    """With rattlers, so that B is singular."""
    found = jamlab.pack(n=64, pressure=1e-2, seed=1)
    assert jamlab.contacts(found).rattlers.any()
    return found


@pytest.mark.parametrize("newton", ["on", "off"])
@pytest.mark.parametrize(("units", "tilt"), [("eps", 0.3), ("k", 0.0)])
def test_elastic_forces_are_the_native_ones(tmp_path, random_disks, units, tilt, newton):
    """Forces, energy, pressure and stress of pair_style harmonic/cut, from the same contacts that drag."""
    packing = random_disks(tilt, units)
    native = jamlab.evaluate(packing)
    with Flow(tmp_path, packing, "rate 1e-3", newton=newton) as flow:
        row = flow.run(0)
        assert flow.forces() == pytest.approx(native.forces, abs=1e-13)
        assert flow.lmp.get_thermo("pe") == pytest.approx(native.energy, rel=1e-13)
        assert flow.lmp.get_thermo("pxy") == pytest.approx(native.stress[0, 1], abs=1e-13)
    assert row["energy"] * packing.area == pytest.approx(native.energy, rel=1e-13)
    assert row["elastic"] == pytest.approx(-native.stress[0, 1], abs=1e-13)


@pytest.mark.parametrize("newton", ["on", "off"])
@pytest.mark.parametrize(("beta", "arms"), [(1.0, "radius"), (0.1, "contact"), (0.0, "radius")])
def test_stress_of_a_step_in_rate_is_the_fast_limit(tmp_path, packing, beta, arms, newton):
    """Viscous stress over rate at time 0 is eta_inf, and so is the dissipation; the pressure is still elastic."""
    limit = jamlab.complex_modulus(packing, [1.0], jamlab.ContactDamping(beta=beta, lever_arms=arms)).eta_inf
    with Flow(tmp_path, packing, "rate 0.01 solver 1e-12", f"1 {beta} arms {arms}", newton) as flow:
        row = flow.run(0)
    assert row["viscous"] / 0.01 == pytest.approx(limit, rel=1e-9)
    assert row["dissipation"] / 0.01**2 == pytest.approx(limit, rel=1e-9)
    assert row["contacts"] == jamlab.contacts(packing).n_contacts


@pytest.mark.parametrize("newton", ["on", "off"])
def test_little_background_drag_takes_few_iterations(tmp_path, packing, newton):
    """Each disk's own block as preconditioner needs 40; velocities are those of B solved densely."""
    background, rate, n = 1e-5, 1e-3, packing.n
    with Flow(tmp_path, packing, f"rate {rate} background {background} solver 1e-8", newton=newton) as flow:
        row, state = flow.run(40), flow.state()
    assert row["last_iterations"] < 15
    drag = jamlab.ContactDamping().matrix(state, state, "simple").toarray()
    matrix = drag[:-1, :-1] + np.diag(np.repeat([background, 0.0], [2 * n, n]))
    force = np.append(jamlab.evaluate(state).forces, np.zeros(n)) - rate * drag[:-1, -1]
    u = np.linalg.lstsq(matrix, force, rcond=1e-14)[0]
    assert row["viscous"] * state.area == pytest.approx(drag[-1, :-1] @ u + rate * drag[-1, -1], rel=1e-5)
    dissipated = u @ matrix @ u + rate * (2 * drag[-1, :-1] @ u + rate * drag[-1, -1])
    assert row["dissipation"] * state.area == pytest.approx(dissipated, rel=1e-6)


@pytest.mark.parametrize("drive", ["rate 1e-5", "oscillate 1e-5 1"])
def test_work_is_stored_or_dissipated_and_errors_fall_as_the_cube_of_the_step(tmp_path, packing, drive):
    """Up to a strain at which no contact has changed: there the flow is smooth."""

    def end(longest):
        settings = f"tolerance 0.1 solver 1e-10 longest {longest} stop 2"
        with Flow(tmp_path, packing, f"{drive} {settings}") as flow:
            start, row = flow.run(0), flow.run()
        assert row["contacts"] == start["contacts"]
        stored = row["energy"] - start["energy"]
        return row["stress"], (row["work"] - row["dissipated"] - stored) / row["work"]

    (exact, _), *coarse = [end(longest) for longest in (0.005, 0.1, 0.05)]
    errors = [abs(stress - exact) for stress, _ in coarse]
    assert 7.0 < errors[0] / errors[1] < 9.5
    assert abs(coarse[0][1]) < 1e-5


def test_power_law_drag_balances_forces(tmp_path, packing):
    """At rest, all drag is that of the affine flow and its answer: stress goes as rate^alpha, dissipation as stress."""
    rows = {}
    at_rest = jamlab.evaluate(packing).stress[0, 1]
    for rate in (1e-3, 1e-2):
        with Flow(tmp_path, packing, f"rate {rate} solver 1e-9", "1 1 alpha 0.5") as flow:
            rows[rate] = flow.run(0)
    assert rows[1e-2]["viscous"] == pytest.approx(rows[1e-3]["viscous"] * 10**0.5, rel=1e-6)
    for rate, row in rows.items():
        assert row["dissipation"] == pytest.approx(row["viscous"] * rate, rel=1e-6)
        assert row["elastic"] == pytest.approx(-at_rest, abs=1e-12)


def test_a_flip_of_the_box_changes_nothing(tmp_path, packing):
    """The same lattice in a box that leans the other way, and flips at another strain."""
    other = packing.box - [[0, 0], packing.box[0]]
    stresses = []
    for box in (packing.box, other):
        start = packing.with_state(box=box)
        with Flow(tmp_path, start, "rate 1 tolerance 0.1 solver 1e-10 longest 0.01 stop 0.05") as flow:
            rows = [flow.run() for _ in range(16)]
            state = flow.state()
        native = jamlab.evaluate(state)
        assert rows[-1]["strain"] == pytest.approx(0.8, rel=1e-12)
        assert rows[-1]["energy"] * state.area == pytest.approx(native.energy, rel=1e-12)
        assert rows[-1]["elastic"] == pytest.approx(-native.stress[0, 1], rel=1e-10)
        assert abs(state.box[1, 0]) < 0.56 * state.box[0, 0]
        stresses.append([row["stress"] for row in rows])
    assert stresses[0] == pytest.approx(stresses[1], rel=1e-6)


def test_split_and_restarted_runs_are_one_run(tmp_path, packing):
    """A split run takes the same steps; a restarted one does until rounding decides on which side of an event one ends.

    `read_restart` moves disks of a leaning box by the last digit, and events are located to a part of a step only.
    """
    fix = "rate 1e-2 solver 1e-12"
    names = ("time", "strain", "stress", "viscous", "energy", "work", "dissipated", "step")
    with Flow(tmp_path, packing, fix) as flow:
        whole = flow.run(60)
    with Flow(tmp_path, packing, fix) as flow:
        flow.run(23)
        flow.lmp.command(f"write_restart {tmp_path}/half.restart")
        first = [flow.run(1) for _ in range(6)]
        split = flow.run(31)
        for line in (
            "clear",
            f"read_restart {tmp_path}/half.restart",
            "neigh_modify every 1 delay 0 check yes",
            f"fix flow all overdamped {fix}",
        ):
            flow.lmp.command(line)
        again = [flow.run(1) for _ in range(6)]
    for name in names:
        assert split[name] == pytest.approx(whole[name], rel=1e-7), name
        assert [row[name] for row in again] == pytest.approx([row[name] for row in first], rel=1e-8), name


def test_two_steps_of_half_the_length_end_an_interval(packing):
    """1.125 steps are left at last: two equal ones, not a whole one and a rest that is nearly nothing."""
    length, times = 1e-4, [0.0]
    with OverdampedSession(packing, jamlab.ContactDamping(), 1e-2, 1e-4) as session:
        session.drive("rate 0.01", 12.1 * length, longest=length)
        while times[-1] < 12.09 * length:
            times.append(session.advance(1).time)
    assert times[-1] == pytest.approx(12.1 * length, rel=1e-9)
    before, last = np.diff(times)[-2:]
    assert last == pytest.approx(before, rel=1e-6) and 0.5 * length < last < length


def test_disks_that_touch_nothing_stay_with_the_affine_flow(packing):
    """Also while all that touches drifts: without a background drag the drift of these alone is taken off."""
    touching = jamlab.contacts(packing)
    apart = np.setdiff1d(np.arange(packing.n), touching.pairs)
    assert len(apart)
    r = jamlab.shear(packing, 1.0, 0.01, rows=1, background_drag=0.0)
    moved = packing.positions[apart] + 0.01 * packing.positions[apart, 1:] * [1.0, 0.0]
    off = (r.packing.positions[apart] - moved) @ np.linalg.inv(r.packing.box)
    assert np.abs(off - off.round()).max() < 1e-9
