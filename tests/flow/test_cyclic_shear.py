"""Quasi-static shear that turns back: turning points, return, limit cycles, hysterons, displacements a cycle."""

from itertools import pairwise

import numpy as np
import plain_cycles
import pytest

import jamlab
from jamlab import quasistatic_shear
from jamlab.flow.limit_cycle import earlier_state, moved_between, pair_events
from jamlab.flow.run import FileSteps, Run
from jamlab.flow.strain_path import StrainPath

TURNS, STEP = [0.03, -0.03, 0.03], 6e-3


@pytest.fixture(scope="module")
def packing():
    return jamlab.pack(n=16, pressure=1e-2, seed=2)


@pytest.fixture(scope="module")
def run(packing):
    return quasistatic_shear(packing, TURNS, STEP, cycles=20, snapshot_every=STEP)


def droplets():
    return list(jamlab.compress(jamlab.jam(6, "dp", seed=3), to=0.9, step=0.05))[-1]


def test_it_goes_to_every_turning_point_by_equal_steps():
    path = StrainPath((0.05, -0.05, 0.05), 0.02, repeats=2, snapshot_every=0.1)
    targets = list(path.targets())
    assert [t.strain for t in targets] == pytest.approx(
        [0.05 / 3, 0.1 / 3, 0.05, *2 * [0.03, 0.01, -0.01, -0.03, -0.05, -0.03, -0.01, 0.01, 0.03, 0.05]]
    )
    assert [t.strain for t in targets if t.ends_cycle] == [0.05, 0.05, 0.05]  # exactly
    assert targets[-1].path == pytest.approx(path.length) == pytest.approx(0.45)
    kept = [t.path for t in targets if t.keep and not t.ends_cycle]
    assert kept == pytest.approx([0.11, 0.21, 0.31, 0.41])  # the first at or beyond each multiple


@pytest.mark.parametrize(
    ("points", "ends"),
    [((0.1, -0.1, 0.0), 2), ((0.1, -0.1), 2), ((0.1, 0.0), 2), ((0.1, -0.1, 0.1), 3), ((0.1, 0.2, 0.1, 0.0), 2)],
)
def test_cycles_begin_where_the_path_is_first_at_its_last_turning_point(points, ends):
    """At the start for 0, which is no target."""
    targets = list(StrainPath(points, 0.1, repeats=2).targets())
    assert [t.strain for t in targets if t.ends_cycle] == [points[-1]] * ends


def test_the_state_returns_to_1e_10_and_does_so_again(packing, run):
    """By plain numpy, after one more cycle from the last state, which the run does not know of."""
    limit = run.limit_cycle
    assert run.state == "periodic" and (limit.period, limit.cycles_before) == (1, 1) and run.finished
    assert limit.distance < 1e-10 and run.converged.all()
    again = quasistatic_shear(run.packing, [-0.06, 0.0], STEP)  # from strain 0.03
    shift, bearing = plain_cycles.moved(run.packing, again.packing)
    assert np.hypot(*shift[bearing].T).max() < 1e-10
    assert again.energy[-1] == pytest.approx(run.energy[-1], rel=1e-11)
    rows = slice(limit.rows[0], limit.rows[1] + 1)
    assert again.stress == pytest.approx(run.stress[rows], abs=1e-10)
    assert limit.events == again.plastic_events == len(again.events)
    assert 0 < limit.dissipated == pytest.approx(again.dissipated[-1], abs=1e-12)


def test_states_and_displacements_by_plain_numpy(run):
    """Energy and stress of every state, ten and more; displacements of both cycles."""
    assert len(run.frames) == len(run.strain) == len(run.frame_rows) > 10
    for row, frame in list(zip(run.frame_rows, run.frames, strict=True))[::4]:
        energy, stress = plain_cycles.disk_energy_and_stress(frame)
        assert energy == pytest.approx(run.energy[row], abs=1e-12) and stress == pytest.approx(
            run.stress[row], abs=1e-12
        )
    ends = [run.frames[row] for row in run.cycle_rows]
    cycles = run.cycles
    assert len(cycles) == 2 and run.strain[run.cycle_rows] == pytest.approx([0.03] * 3, abs=0)
    for k, (before, after) in enumerate(pairwise(ends)):
        shift, bearing = plain_cycles.moved(before, after)
        assert cycles.displacements[k] == pytest.approx(shift, abs=1e-10)
        lengths = np.hypot(*shift[bearing].T)
        assert cycles.displacement[k] == pytest.approx(lengths.mean(), abs=1e-10)
        assert cycles.largest[k] == pytest.approx(lengths.max(), abs=1e-10)
    work = [np.sum(0.5 * (s[1:] + s[:-1]) * np.diff(g)) for s, g in _loops(run)]
    stored = np.diff(run.energy[run.cycle_rows])
    assert cycles.dissipated == pytest.approx(work - stored, abs=1e-12)
    assert cycles.events.sum() == run.event[run.cycle_rows[0] + 1 :].sum()


def _loops(run):
    bounds = zip(run.cycle_rows[:-1], run.cycle_rows[1:], strict=True)
    return [(run.stress[a : b + 1], run.strain[a : b + 1]) for a, b in bounds]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_64_disks_return_at_5_percent(seed):
    packing = jamlab.pack(n=64, pressure=1e-2, seed=seed)
    run = quasistatic_shear(packing, [0.05, -0.05, 0.05], 5e-3, cycles=20)
    assert run.limit_cycle.distance < 1e-10
    again = quasistatic_shear(run.packing, [-0.1, 0.0], 5e-3)
    shift, bearing = plain_cycles.moved(run.packing, again.packing)
    assert np.hypot(*shift[bearing].T).max() < 1e-10


def permuted(p, rng):
    order = rng.permutation(p.n)
    return p.with_state(positions=p.positions[order], diameters=p.disk_diameters[order])


def in_images(p, rng):
    return p.with_state(positions=p.positions + rng.integers(-2, 3, (p.n, 2)) @ p.box + np.array([0.4, 1.7]))


def of_another_lattice(p, rng):
    return p.with_state(box=p.box + np.outer([0, 2], p.box[0]))


def in_other_units(p, rng):
    return p.with_state(box=3e-6 * p.box, positions=3e-6 * p.positions, diameters=3e-6 * p.disk_diameters)


@pytest.mark.slow
@pytest.mark.parametrize("view", [permuted, in_images, of_another_lattice, in_other_units])
def test_limit_cycles_are_invariant(packing, run, view):
    """Period, switching strains, displacements and energies, in the units of the packing."""
    seen = view(packing, np.random.default_rng(5))
    length = seen.disk_diameters.mean() / packing.disk_diameters.mean()
    found = quasistatic_shear(seen, TURNS, STEP, cycles=20)
    limit, other = run.limit_cycle, found.limit_cycle
    assert (other.period, other.cycles_before, other.events) == (limit.period, limit.cycles_before, limit.events)
    assert other.hysterons.on == pytest.approx(limit.hysterons.on, abs=1e-12)
    assert other.hysterons.off == pytest.approx(limit.hysterons.off, abs=1e-12)
    assert other.hysterons.size / length == pytest.approx(limit.hysterons.size, rel=1e-6)
    assert found.cycles.displacement[0] / length == pytest.approx(run.cycles.displacement[0], rel=1e-6)
    assert other.dissipated == pytest.approx(limit.dissipated, rel=1e-6) and other.distance < 1e-9


def test_an_elastic_cycle_takes_no_work(packing):
    """There and back through the same minima; events on the way back have their signs."""
    run = quasistatic_shear(packing, [2e-3, -2e-3, 0.0], 1e-3, cycles=3)
    assert not run.event.any() and len(run.cycles) == 1 and run.limit_cycle.cycles_before == 0
    assert run.strain == pytest.approx([0, 1e-3, 2e-3, 1e-3, 0, -1e-3, -2e-3, -1e-3, 0])
    assert run.stress[[0, 1]] == pytest.approx(run.stress[[4, 3]], abs=1e-12)
    assert run.stress[[4, 5]] == pytest.approx(run.stress[[8, 7]], abs=1e-12)
    assert abs(run.work[-1]) < 1e-12 and abs(run.cycles.dissipated[0]) < 1e-12
    assert run.cycle_rows.tolist() == [0, 8]


def test_stress_that_falls_on_the_way_back_is_no_drop():
    """A fall is one along the step: no step back is tried, so that there are as many steps as states."""
    run = quasistatic_shear(jamlab.pack(16, 1e-2, seed=3), [2e-3, -2e-3, 0.0], 1e-3)
    assert (np.diff(run.stress) * np.diff(run.strain) > 0).all()
    assert run.steps == len(run.strain) and not len(run.events)


@pytest.mark.slow
def test_events_of_both_ways_are_seen_alike(packing, run):
    """A shear to and fro is the shear by hand, leg by leg, and stress drops are along the way they go."""
    there = quasistatic_shear(packing, 0.03, STEP)
    back = quasistatic_shear(there.packing, -0.06, STEP)
    n, m = len(there.strain), len(back.strain)
    assert run.stress[:n] == pytest.approx(there.stress, abs=1e-12)
    assert run.stress[n - 1 : n + m - 1] == pytest.approx(back.stress, abs=1e-11)
    assert run.event[n : n + m - 1].tolist() == back.event[1:].tolist()
    k = np.flatnonzero(run.event)
    way = np.sign(run.strain[k] - run.strain[k - 1])
    assert run.events.stress_drop == pytest.approx(way * (run.stress[k - 1] - run.stress[k]))
    assert {*run.drops.strain} <= {*run.strain[k - 1]}


def test_displacements_of_events_lie_between_two_minima_at_one_strain(packing, run):
    """The step back from after an event: by hand, from the packings before and after."""
    k = int(np.flatnonzero(run.event)[0])
    before, after = run.frames[k - 1], run.frames[k]
    back = quasistatic_shear(after, run.strain[k - 1] - run.strain[k], STEP).packing
    shift, bearing = plain_cycles.moved(before, back)
    assert run.event_displacements[0] == pytest.approx(np.where(bearing[:, None], shift, 0.0), abs=1e-9)
    assert len(run.event_displacements) == len(run.events)


def test_hysterons_are_pairs_that_undo_each_other(run):
    found = run.limit_cycle.hysterons
    assert len(found) * 2 + found.unpaired == run.limit_cycle.events
    assert len(found) and (found.hysteresis > 0).all() and (found.reversal >= 0.5).all()
    assert {*found.on} <= {*run.strain[run.event]} and found.width_on == pytest.approx(STEP)


def test_events_are_paired_by_their_displacements():
    rng = np.random.default_rng(1)
    a, b, c = rng.normal(size=(3, 5, 2))
    strain, step = np.array([0.01, 0.02, 0.03, 0.0, -0.01, 0.04]), np.array([1e-3, 1e-3, 1e-3, -2e-3, -2e-3, -2e-3])
    found = pair_events(strain, step, np.array([a, b, c, -b, -1.1 * a, -c]))
    assert sorted(zip(found.on, found.off, strict=True)) == [(0.01, -0.01), (0.02, 0.0)]  # c stays on above it: no
    assert found.unpaired == 2 and found.width_off == pytest.approx(2e-3)
    assert found.size[found.on == 0.02] == pytest.approx(np.linalg.norm(b))
    assert found.reversal[found.on == 0.01] == pytest.approx(2.2 / 2.21) and found.reversal.max() == pytest.approx(1)
    none = pair_events(np.zeros(0), np.zeros(0), np.zeros((0, 5, 2)))
    assert len(none) == 0 == none.unpaired


def test_the_period_is_the_number_of_cycles_since_the_same_state(packing):
    """Of two states in turn; a rattler that moves, a common motion and another image do not matter."""
    rng = np.random.default_rng(3)
    other = packing.with_state(positions=packing.positions + 1e-3 * rng.normal(size=(16, 2)))
    moved = packing.positions + np.array([0.3, -0.2])
    loose = np.flatnonzero(jamlab.contacts(packing).rattlers)
    moved[loose] += 0.01
    moved[3] += packing.box[1] - 2 * packing.box[0]
    same = packing.with_state(positions=moved)
    assert len(loose), "the packing has a rattler"
    energy = np.array([1.0, 2.0, 1.0])
    period, distance = earlier_state([packing, other, same], energy, 0.0)
    assert period == 2 and distance < 1e-12
    assert earlier_state([other, packing], energy[:2], 0.0) == (0, pytest.approx(np.nan, nan_ok=True))
    assert earlier_state([other, packing], np.ones(2), 0.0)[0] == 0  # by its positions
    assert moved_between(packing, other).distance > 1e-4


@pytest.mark.parametrize(
    "how",
    [
        {"direction": "pure"},
        pytest.param({"direction": "pure", "pressure": "constant"}, marks=pytest.mark.slow),
        pytest.param({"direction": 0.7, "pressure": 5e-3}, marks=pytest.mark.slow),
    ],
)
def test_limit_cycles_in_any_direction_and_at_constant_pressure(packing, how):
    run = quasistatic_shear(packing, [0.02, -0.02, 0.0], 0.01, cycles=12, **how)
    assert run.state == "periodic" and run.limit_cycle.distance < 1e-8
    assert run.area[run.cycle_rows[-1]] == pytest.approx(run.area[run.cycle_rows[-1 - run.period]], rel=1e-8)


@pytest.mark.parametrize("flat", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_limit_cycles_between_walls(flat):
    walled = jamlab.with_walls(jamlab.pack(24, 1e-2, seed=1), 1.2, flat=flat)
    run = quasistatic_shear(walled, [0.02, -0.02, 0.02], 0.01, cycles=10)
    assert run.state == "periodic" and np.abs(run.cycles.displacements[:, walled.frame.fixed]).max() < 1e-13
    assert len(run.wall_stress) == len(run.strain)


def test_limit_cycles_of_droplets():
    run = quasistatic_shear(droplets(), [0.02, -0.02, 0.02], 0.01, cycles=6)
    assert run.state == "periodic" and run.limit_cycle.distance < 1e-8
    assert run.cycles.displacements.shape == (len(run.cycles), 6, 2)


def test_unjammed_packings_turn_back_too():
    """All particles count where none bears force."""
    run = quasistatic_shear(jamlab.pack(8, phi=0.2, seed=1), [0.02, -0.02, 0.0], 0.02, cycles=8)
    assert run.state == "periodic" and run.limit_cycle.events == 0 and run.cycles.largest[-1] < 1e-7


@pytest.mark.parametrize("how", [{}, pytest.param({"pressure": "constant"}, marks=pytest.mark.slow)])
def test_it_goes_on_from_its_file(packing, tmp_path, how):
    """Interrupted at the strain at which a cycle began, but half a cycle later; then with more cycles."""
    file, turns = tmp_path / "run.h5", [0.03, -0.03, 0.0]

    def stop(share, words):
        if share > stop.at:
            raise KeyboardInterrupt

    def drive(cycles, **more):
        return quasistatic_shear(packing, turns, 0.015, cycles=cycles, **how, **more)

    stop.at = 0.45 / 2  # beyond the first leg there and back: strain 0, no end of a cycle
    with pytest.MonkeyPatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr("jamlab.flow.run.RECORD", FileSteps(every=0.0))
        drive(2, path=file, progress=stop)
    part = jamlab.read_flow(file)
    assert part.state == "interrupted" and part.strain[-1] == 0 and len(part.cycle_rows) == 1 and part.period == 0
    assert part.frame_rows.tolist() == [0, len(part.strain) - 1]
    drive(1, path=file)
    found, run = drive(12, path=file), drive(12)
    assert found.strain == pytest.approx(run.strain, abs=0) and found.stress == pytest.approx(run.stress, abs=1e-9)
    assert found.cycle_rows.tolist() == run.cycle_rows.tolist() and found.period == run.period > 0
    assert found.event_displacements == pytest.approx(run.event_displacements, abs=1e-7)
    assert found.cycles.displacements == pytest.approx(run.cycles.displacements, abs=1e-7)
    kept = jamlab.read_flow(file)
    assert kept.limit_cycle.hysterons.on.tolist() == found.limit_cycle.hysterons.on.tolist()
    assert kept.state == "periodic" and drive(12, path=file).steps == found.steps


def test_what_is_shown(run):
    assert "periodic" in repr(run) and "hysterons" in repr(run)
    assert list(run.cycles.to_dataframe()) == ["cycle", "displacement", "largest", "dissipated", "events"]
    ax = run.plot()
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert any("limit cycle of period 1" in text for text in texts) and any("transient" in text for text in texts)
    assert "limit cycle" in run.cycles.plot().get_legend().get_texts()[-1].get_text()
    assert "hysteron" in run.limit_cycle.hysterons.plot().get_legend().get_texts()[0].get_text()
    assert np.isfinite(run.velocity_profile.velocity).all() and run.peak is None
    assert [frame.provenance["flow_strain"] for frame in run.frames] == run.strain[run.frame_rows].tolist()


BAD = [
    ({"strain": []}, "strain = .*turning points such as"),
    ({"strain": [0.0, 0.1]}, r"strain\[0\] = 0: must be other than 0"),
    ({"strain": [0.1, 0.1]}, r"strain\[1\] = 0.1: must be other than strain\[0\]"),
    ({"strain": [0.1, np.nan]}, "strain = nan: must be"),
    ({"strain": [0.1, 2000.0]}, "strain = 2000.*1000"),
    ({"strain": "0.1"}, "strain = '0.1'.*must be a number"),
    ({"strain": [0.5, -1.5], "direction": "pure"}, "strain = -1.5: must be at most 1"),
    ({"strain": 0.1, "cycles": 3}, r"cycles = 3: .*give turning points, strain=\[0.1, 0\]"),
    ({"strain": [0.1, 0.0], "cycles": 0}, "cycles = 0: must be a whole number from 1"),
    ({"strain": [0.1, 0.0], "cycles": 2.5}, "cycles = 2.5.*must be a whole number"),
    ({"strain": [0.01, 0.005], "strain_step": 0.02}, "strain_step = 0.02: must be a number from .* to 0.01"),
    ({"strain": [0.1, 0.0], "strain_step": 0.01, "snapshot_every": 1.0}, "snapshot_every = 1"),
    ({"strain": 0.1, "until_jammed": True}, "until_jammed = True: the packing is jammed at phi = .*below its"),
    ({"strain": 0.1, "until_jammed": True, "pressure": 1e-3}, "until_jammed = True, pressure = 0.001.*leave one"),
    ({"strain": 0.1, "until_jammed": 1e-6}, "until_jammed = 1e-06.*must be True or False"),
]


@pytest.mark.parametrize(("arguments", "said"), BAD)
def test_what_is_no_path_is_refused(packing, arguments, said):
    with pytest.raises(jamlab.InputError, match=said) as caught:
        quasistatic_shear(packing, **{"strain_step": 0.01} | arguments)
    assert "\n" not in str(caught.value)


def test_packings_that_are_unjammed_come_to_rest():
    """Their energies are what residual forces leave, and tell nothing."""
    p = jamlab.pack(n=16, phi=0.5, seed=1)
    run = jamlab.quasistatic_shear(p, [0.02, -0.02, 0.02], 1e-2, cycles=15)
    assert run.state == "periodic" and run.cycles.largest[-1] < 1e-6


def test_walls_at_constant_pressure_come_back_with_the_strain():
    p = jamlab.with_walls(jamlab.pack(24, 1e-2, seed=3), 1.3)
    run = jamlab.quasistatic_shear(p, [0.02, -0.02, 0.02], 4e-3, cycles=3, pressure="constant")
    assert np.ptp(run.area) > 1e-4 * run.area[0]
    moved = [q.positions[q.fixed] - p.positions[q.fixed] for q in run.frames]
    tall = p.box[1, 1]
    assert [np.ptp(each[:, 0]) for each in moved] == pytest.approx(
        [abs(q.provenance["flow_strain"]) * tall for q in run.frames], abs=1e-12
    )
    assert run.period == 1 and run.cycles.largest[-1] < 1e-10 and run.energy_error < 0.01


def test_a_file_by_the_present_height_of_walls_is_another_run(tmp_path, monkeypatch):
    p = jamlab.relax(jamlab.with_walls(jamlab.pack(32, 1e-2, seed=1), thickness=1.5))
    how = {"strain_step": 1e-3, "pressure": "constant", "path": tmp_path / "run.h5"}
    jamlab.quasistatic_shear(p, 1e-3, **how)
    assert len(jamlab.quasistatic_shear(p, 2e-3, **how).strain) == 3
    monkeypatch.setattr(Run, "__init__", _without(Run.__init__, "strain_over"))
    with pytest.raises(jamlab.StorageError, match="another run"):
        jamlab.quasistatic_shear(p, 3e-3, **how)


def _without(begin, name):
    """The start of a run whose task lacks an entry, as runs of the earlier definition did."""

    def begun(self, kind, packing, damping, task, *rest):
        begin(self, kind, packing, damping, {key: value for key, value in task.items() if key != name}, *rest)

    return begun
