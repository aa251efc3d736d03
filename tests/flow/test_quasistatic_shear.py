"""Quasi-static shear: a closed form, the linear branch, independence of the step, events, flips of the box."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq

import jamlab
from jamlab import quasistatic_shear
from jamlab.flow.run import FileSteps
from jamlab.geometry.vertex_contacts import vertex_contacts
from jamlab.packing.deformation import sheared


def crystal(distance=0.9):
    """Hexagonal crystal of unit disks, 4 x 4, in units "k"."""
    i, j = np.divmod(np.arange(16), 4)
    x = distance * np.column_stack([i + 0.5 * (j % 2), np.sqrt(0.75) * j])
    return jamlab.Packing("sp", distance * np.diag([4.0, 4 * np.sqrt(0.75)]), x, {"k": 2.0}, "k", np.ones(16))


def meetings(packing):
    """Disks that touch; vertices with the edges, or with the corners, that they touch."""
    if packing.model == "sp":
        return set(map(tuple, jamlab.contacts(packing).pairs))
    found = vertex_contacts(packing)
    corner = np.where(found.place == 1, packing.polygons.successor[found.tail], found.tail)
    inside = (found.place > 0) & (found.place < 1)
    return set(zip(found.vertex, np.where(inside, found.tail, -1 - corner), strict=True))


@pytest.fixture(scope="module")
def packing():
    return jamlab.pack(n=24, pressure=1e-2, seed=4)


@pytest.fixture(scope="module")
def run(packing):
    return quasistatic_shear(packing, strain=0.024, strain_step=2e-3)


def test_a_crystal_is_sheared_affinely():
    """Until it gives way: springs of three directions, whose lengths follow from the strain; 3 contacts a disk."""
    a, k = 0.9, 2.0
    found = quasistatic_shear(crystal(a), strain=0.12, strain_step=0.01)
    r = a * np.array([[1.0, 0.0], [0.5, np.sqrt(0.75)], [-0.5, np.sqrt(0.75)]])
    r = r + found.strain[:, None, None] * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 0.0]]) * r[:, [1]]
    length = np.hypot(r[..., 0], r[..., 1])
    overlap = np.maximum(0.0, 1.0 - length)
    area = a * a * np.sqrt(0.75)  # of a disk
    assert found.stress == pytest.approx(-(k * overlap * r[..., 0] * r[..., 1] / length).sum(axis=1) / area, abs=1e-12)
    assert found.energy == pytest.approx(0.5 * k * (overlap**2).sum(axis=1) / area, rel=1e-11)
    n1 = (-k * overlap * (r[..., 0] ** 2 - r[..., 1] ** 2) / length).sum(axis=1) / area
    assert found.normal_stress_difference == pytest.approx(n1, abs=1e-12)
    assert found.converged.all() and not len(found.events)
    stored = found.energy - found.energy[0]  # all of the work, to the error of the trapezoidal rule
    assert found.work == pytest.approx(stored, rel=0.01, abs=1e-12)
    assert abs(found.dissipated).max() < 0.01 * stored.max()


@pytest.mark.parametrize(("model", "step"), [("sp", 1e-4), ("dp", 2e-6)])
def test_stress_between_events_rises_with_the_shear_modulus(request, packing, model, step):
    """By the mean of G at both ends, in every step in which no contact changes; vertices of droplets slide along."""
    start = packing if model == "sp" else request.getfixturevalue("dp_dense")
    found = quasistatic_shear(start, strain=4 * step, strain_step=step, snapshot_every=step, force_tolerance=1e-13)
    states = found.frames
    assert found.converged.all() and len(states) == len(found.strain) == 5
    modulus = np.array([jamlab.shear_modulus(state, direction="simple") for state in states])
    who = [meetings(state) for state in states]
    same = [one == two for one, two in pairwise(who)]
    assert sum(same) >= 2
    slope = np.diff(found.stress) / np.diff(found.strain)
    assert slope[same] == pytest.approx(0.5 * (modulus[1:] + modulus[:-1])[same], rel=1e-3)


@pytest.mark.parametrize("times", [2, pytest.param(4, marks=pytest.mark.slow)])
def test_states_up_to_the_first_event_do_not_depend_on_the_step(packing, run, times):
    """Nor does the place of the event, within a step."""
    fine = quasistatic_shear(packing, strain=run.events.strain[0], strain_step=2e-3 / times)
    until = run.strain < run.events.strain[0] - 1e-9
    assert until.sum() > 5
    assert fine.stress[::times][: until.sum()] == pytest.approx(run.stress[until], rel=1e-6)
    assert 0 <= run.events.strain[0] - fine.events.strain[0] < 2e-3


def test_work_is_stored_but_for_what_events_release(run):
    work = np.sum(0.5 * (run.stress[1:] + run.stress[:-1]) * np.diff(run.strain))
    released = run.events.released.sum()
    assert len(run.events) and np.all(run.events.released > 0) and np.all(run.events.stress_drop > 0)
    assert work - released == pytest.approx(run.energy[-1] - run.energy[0], rel=0.05, abs=0.05 * released)


def test_drops_begin_at_the_state_before_the_fall(run):
    """Size and place are those of two states one after the other."""
    assert len(run.drops.strain)
    for strain, size in zip(*run.drops, strict=True):
        k = int(np.argmin(np.abs(run.strain - strain)))
        assert run.strain[k] == pytest.approx(strain, abs=1e-12)
        assert run.stress[k] - run.stress[k + 1] == pytest.approx(size, rel=1e-12)


def test_the_box_flips_and_energy_goes_on(packing):
    """The same lattice: a packing that leans too far is one that leans back, of the same energy and stress."""
    found = quasistatic_shear(packing, strain=0.6, strain_step=0.05, snapshot_every=0.1)
    assert [round(frame.provenance["flow_strain"], 12) for frame in found.frames] == [0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
    assert found.packing.box[1, 0] == pytest.approx(-0.4 * packing.box[0, 0])
    last = jamlab.evaluate(found.packing)
    assert last.energy / packing.area == pytest.approx(found.energy[-1], rel=1e-12)
    assert -last.stress[0, 1] == pytest.approx(found.stress[-1], abs=1e-14)
    before = found.frames[-2]
    ahead = sheared(before, 0.08)
    assert quasistatic_shear(ahead, strain=1e-9, strain_step=1e-9).energy[0] == pytest.approx(
        quasistatic_shear(before, strain=0.08, strain_step=0.08).energy[-1], rel=1e-9
    )


@pytest.mark.parametrize("direction", ["pure", 0.7])
def test_work_in_any_direction_is_the_rise_of_the_energy(packing, direction):
    """Stress is the slope of the energy in the strain, whatever way the box turns; the area stays."""
    found = quasistatic_shear(packing, strain=1e-3, strain_step=1e-4, direction=direction)
    assert found.converged.all() and not len(found.events)
    assert found.work == pytest.approx(found.energy - found.energy[0], rel=1e-3, abs=1e-11)
    assert found.packing.area == pytest.approx(packing.area, rel=1e-13) and found.packing.box[0, 1] == 0
    slope = np.diff(found.stress)[0] / 1e-4
    assert slope == pytest.approx(jamlab.shear_modulus(packing, direction=direction), rel=1e-2)


def test_pure_shear_stretches_the_box_and_goes_back():
    """A crystal: by half the strain along x, and the same energy on the way back."""
    there = quasistatic_shear(crystal(), strain=0.04, strain_step=0.01, direction="pure")
    box = there.packing.box
    assert box[[0, 1], [0, 1]] == pytest.approx(crystal().box[[0, 1], [0, 1]] * np.exp([0.02, -0.02]), rel=1e-12)
    assert box[1, 0] == 0 and there.normal_stress_difference == pytest.approx(2 * there.stress, rel=1e-12)
    back = quasistatic_shear(there.packing, strain=-0.04, strain_step=0.01, direction="pure")
    assert back.energy[::-1] == pytest.approx(there.energy, rel=1e-9)


def test_shear_along_y_is_shear_along_x_of_what_is_turned(packing):
    """Against the other rotation of the box: simple shear along y turns the first vector of the box."""
    found = quasistatic_shear(packing, strain=0.05, strain_step=5e-3, direction=np.pi / 2)
    quarter = packing.with_state(
        positions=packing.positions[:, ::-1] * [1, -1], box=np.diag(packing.box[[1, 0], [1, 0]])
    )
    there = quasistatic_shear(quarter, strain=0.05, strain_step=5e-3)
    for name in ("stress", "energy", "normal_stress_difference", "pressure"):
        assert getattr(found, name) == pytest.approx(getattr(there, name), rel=1e-7, abs=1e-9)


@pytest.mark.parametrize(
    "how",
    [
        {},
        pytest.param({"direction": 0.4}, marks=pytest.mark.slow),
        {"pressure": "constant"},
    ],
)
def test_it_goes_on_from_its_file(packing, tmp_path, how):
    """Up to the step that an interrupted run had reached, and on to the same end."""
    file, strain = tmp_path / "run.h5", 0.024

    def stop(share, words):
        if share > 0.6:
            raise KeyboardInterrupt

    def drive(**more):
        return quasistatic_shear(packing, strain, 2e-3, snapshot_every=8e-3, **how, **more)

    with pytest.MonkeyPatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr("jamlab.flow.run.RECORD", FileSteps(every=0.0))
        drive(path=file, progress=stop)
    part = jamlab.read_flow(file)
    assert part.state == "interrupted" and part.strain[-1] == pytest.approx(0.016)
    seen = []
    found, run = drive(path=file, progress=lambda share, words: seen.append(share)), drive()
    assert min(seen) > 0.6 and found.finished and len(found.frames) == len(run.frames)
    assert found.stress == pytest.approx(run.stress, abs=1e-9)
    assert found.plastic_events == len(run.events) == len(jamlab.read_flow(file).events)
    assert found.work[-1] - found.dissipated[-1] == pytest.approx(found.enthalpy[-1] - found.enthalpy[0])
    assert found.area == pytest.approx(run.area, rel=1e-9) and part.held_pressure == run.held_pressure
    assert found.z_all[-1] == jamlab.contacts(found.packing).z_all
    assert found.packing.difference(jamlab.read(file)) is None


@pytest.mark.parametrize("unit", [1.0, 3e-6])
def test_a_crystal_at_constant_pressure_compacts(unit):
    """By as much as its springs say, in any unit of length; the first three states touch in three directions."""
    a, k, pressure = 0.9, 2.0, 0.3
    given = crystal(a)
    given = given.with_state(box=unit * given.box, positions=unit * given.positions, diameters=unit * given.diameters)
    found = quasistatic_shear(given, strain=0.04, strain_step=0.02, pressure=pressure)
    bonds = np.array([[1.0, 0.0], [0.5, np.sqrt(0.75)], [-0.5, np.sqrt(0.75)]])

    def stress_at(distance, strain):
        r = distance * (bonds + strain * bonds[:, [1]] * [1.0, 0.0])
        length = np.hypot(*r.T)
        return np.einsum("b,bi,bj->ij", k * (1 - length) / length, r, r) / (distance**2 * np.sqrt(0.75))

    for strain, area, stress in zip(found.strain, found.area, found.stress, strict=True):
        distance = brentq(lambda d, g=strain: np.trace(stress_at(d, g)) / 2 - pressure, 0.7, 0.99, xtol=1e-15)
        assert area == pytest.approx(16 * (unit * distance) ** 2 * np.sqrt(0.75), rel=1e-9)
        assert stress == pytest.approx(-stress_at(distance, strain)[0, 1], abs=1e-9)
    assert found.dilation[-1] < -1e-4 and found.pressure == pytest.approx(pressure, rel=1e-9)


@pytest.mark.parametrize(("model", "step"), [("sp", 2e-5), ("dp", 2e-6)])
def test_work_at_constant_pressure_is_the_change_of_enthalpy(request, packing, model, step):
    """Along one minimum, to the error of the trapezoidal rule; from the energy of LAMMPS and the area."""
    start = packing if model == "sp" else request.getfixturevalue("dp_dense")
    found = quasistatic_shear(
        start, strain=5 * step, strain_step=step, snapshot_every=step, pressure="constant", force_tolerance=1e-13
    )
    first = jamlab.evaluate(found.frames[0])
    assert found.converged.all() and len(found.frames) == 6 and found.held_pressure == pytest.approx(first.pressure)
    pressures = np.array([jamlab.evaluate(frame).pressure for frame in found.frames])
    assert pressures == pytest.approx(first.pressure, rel=1e-8) and found.dilation[-1] != 0
    last = jamlab.evaluate(found.packing)
    grown = found.packing.area - found.frames[0].area
    change = (last.energy - first.energy + first.pressure * grown) / found.frames[0].area
    assert found.work[-1] == pytest.approx(change, rel=1e-6)
    assert found.enthalpy[-1] - found.enthalpy[0] == pytest.approx(change, rel=1e-6)


def test_pressure_is_held_through_events(packing):
    found = quasistatic_shear(packing, strain=0.06, strain_step=2e-3, pressure=2e-2, direction="pure")
    assert len(found.events) and found.converged.all()
    assert found.pressure == pytest.approx(2e-2, rel=1e-8)
    assert found.summary["dilation"] == found.dilation[-1] == found.packing.area / found.frames[0].area - 1


@pytest.mark.parametrize(
    ("pressure", "seed"),
    [(1e-6, 1), *(pytest.param(10.0**-k, s, marks=pytest.mark.slow) for k in (5, 6, 8) for s in (1, 2, 3))],
)
def test_packings_that_unjam_at_constant_pressure_are_brought_back(pressure, seed):
    """Near onset strain steps take contacts away; pressure by LAMMPS, to rounding."""
    start = jamlab.pack(n=32, pressure=pressure, seed=seed)
    found = quasistatic_shear(
        start, strain=-0.01, strain_step=2e-3, direction="pure", pressure="constant", snapshot_every=2e-3
    )
    assert found.converged.all() and np.ptp(found.area) > 0
    for frame in found.frames:
        state = jamlab.evaluate(frame)
        assert state.pressure == pytest.approx(found.held_pressure, rel=1e-9, abs=3e-15)
        assert state.max_force < 1e-11 and not jamlab.contacts(frame).unjammed


def test_droplets_come_down_to_a_pressure_far_below_their_own():
    """Not in one step, in which contacts are lost, and outlines cross when they are sought again."""
    *_, dense = jamlab.compress(jamlab.jam(8, "dp", seed=5), to=0.92, step=0.03)
    assert jamlab.evaluate(dense).pressure == pytest.approx(0.174, abs=1e-3)
    for pressure in (1e-2, 2e-3, 1e-4):
        found = quasistatic_shear(dense, strain=1e-4, strain_step=1e-4, pressure=pressure)
        assert found.converged.all() and jamlab.evaluate(found.packing).pressure == pytest.approx(pressure, rel=2e-9)


@pytest.mark.parametrize("pressure", ["Constant", "", "0.01", np.nan, np.inf, -1e-2, 0.0, 1.5, 1e300, 2**70])
def test_what_is_no_pressure_is_refused(packing, pressure):
    with pytest.raises(jamlab.InputError) as caught:
        quasistatic_shear(packing, 0.01, 1e-3, pressure=pressure)
    assert (f"{pressure:g}" if isinstance(pressure, float) else repr(pressure)[:10]) in str(caught.value)


def test_an_unjammed_packing_has_no_pressure_to_be_held():
    """A number brings it there."""
    loose = jamlab.pack(n=8, phi=0.5, seed=1)
    with pytest.raises(jamlab.InputError, match="unjammed"):
        quasistatic_shear(loose, strain=1e-3, strain_step=1e-3, pressure="constant")
    found = quasistatic_shear(loose, strain=1e-3, strain_step=1e-3, pressure=1e-4)
    assert found.converged.all() and jamlab.evaluate(found.packing).pressure == pytest.approx(1e-4, rel=1e-9)


def test_states_that_miss_the_tolerance_say_so(packing):
    found = quasistatic_shear(packing, strain=1e-3, strain_step=5e-4, force_tolerance=1e-15)
    assert np.array_equal(found.converged, found.max_force <= 1e-15)
    assert (found.force_tolerance, found.tolerance) == (1e-15, None) and "force tolerance 1e-15" in repr(found)
    assert found.packing.converged is bool(found.converged[-1])
    assert found.packing.max_force == found.max_force[-1]


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"strain": 0.0}, "strain = 0.0"),
        ({"strain": 1.1, "direction": "pure"}, "strain = 1.1"),
        ({"strain": 0.1, "direction": "oblique"}, "'oblique'"),
        ({"strain": 0.1, "direction": np.nan}, "nan"),
        ({"strain": 0.5, "strain_step": 0.2}, "strain_step = 0.2"),
        ({"strain": 0.1, "strain_step": 0.01, "snapshot_every": 0.001}, "snapshot_every = 0.001"),
        ({"strain": 0.1, "force_tolerance": 1e-20}, "tolerance = 1e-20"),
    ],
)
def test_numbers_out_of_range_are_refused(packing, arguments, named):
    with pytest.raises(jamlab.InputError, match=named):
        quasistatic_shear(packing, **arguments)


@pytest.mark.parametrize("stickiness", [0.0, 0.05])
def test_flat_walls_bear_no_stress_so_there_are_no_plastic_events_out_of_rounding(stickiness):
    """Nor a peak, nor an imbalance of the energy."""
    flat = jamlab.with_walls(jamlab.pack(n=16, pressure=1e-2, seed=1, law={"stickiness": stickiness}), 1.5, flat=True)
    found = quasistatic_shear(flat, strain=0.05, strain_step=0.01)
    assert abs(found.stress).max() < 1e-12 and not len(found.events) and not len(found.drops.size)
    assert found.peak is None and found.energy_error == 0 and found.balanced


def test_a_packing_that_unjams_has_no_plastic_events():
    """Stresses of 1e-14 rise and fall at random."""
    found = quasistatic_shear(jamlab.pack(n=16, phi=0.5, seed=1), strain=0.05, strain_step=0.01)
    assert abs(found.stress).max() < 1e-12 and not len(found.events) and found.balanced


def test_energy_that_sticky_disks_lose_without_stress_is_released_by_events():
    """A floppy network: disks meet and stick, and a step back does not part them; work is zero until stress rises."""
    found = quasistatic_shear(
        jamlab.pack(n=32, phi=0.6, seed=2, law={"stickiness": 0.1}), strain=0.08, strain_step=0.01
    )
    lost = -np.diff(found.energy)
    still = abs(found.stress[1:]) < 1e-12
    assert found.event[1:][still].tolist() == (lost[still] > 1e-9).tolist() and found.event.any()
    assert found.events.released.sum() == pytest.approx(found.energy[0] - found.energy[-1] + found.work[-1], rel=1e-3)
    assert found.balanced and not len(found.drops.size)


def test_events_in_which_stress_rises_are_seen_by_the_energy_they_lose():
    """The next minimum may have a larger stress; in finer steps too, and it releases the same."""
    start = jamlab.pack(n=24, pressure=1e-2, seed=3)
    coarse, fine = (quasistatic_shear(start, strain=0.022, strain_step=step) for step in (2e-3, 5e-4))
    for found in (coarse, fine):
        assert len(found.events) == found.plastic_events == 1 and not len(found.drops.size)
        assert found.events.stress_drop[0] < -1e-4 and found.energy_error < 5e-3
    assert fine.events.released == pytest.approx(coarse.events.released, rel=0.1)
    assert 0.02 < fine.events.strain[0] <= coarse.events.strain[0] == pytest.approx(0.022)


def test_a_run_resumes_to_a_strain_whose_step_rounds_otherwise(tmp_path):
    """0.071/71 is not 1e-3."""
    p = jamlab.Packing("sp", np.eye(2), [[0.2, 0.3]], {"k": 1.0}, "k", [1.05])
    quasistatic_shear(p, 0.04, 1e-3, path=tmp_path / "run.h5")
    assert quasistatic_shear(p, 0.071, 1e-3, path=tmp_path / "run.h5").strain[-1] == pytest.approx(0.071)
