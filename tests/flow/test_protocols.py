"""Flow as people drive it: the other way, to and fro, in parts, stopped; and what is refused of a flowing state."""

from pathlib import Path

import numpy as np
import pytest

import jamlab
from jamlab.flow.run import FileSteps


@pytest.fixture(scope="module")
def packing():
    return jamlab.pack(n=32, pressure=1e-2, seed=1)


@pytest.fixture(scope="module")
def flowing(packing):
    return jamlab.shear(packing, 0.05, 0.1, rows=5).packing


def mirrored(packing):
    """x to -x: shear one way is shear the other way of the mirror image."""
    flipped = np.array([-1.0, 1.0])
    box = packing.box * [[1.0, 1.0], [-1.0, 1.0]]
    return packing.with_state(positions=packing.positions * flipped + [packing.box[0, 0], 0.0], box=box)


def test_a_negative_rate_is_the_mirror_image(packing):
    one = jamlab.shear(packing, 0.1, 0.1, rows=10, tolerance=1e-6)
    other = jamlab.shear(mirrored(packing), -0.1, 0.1, rows=10, tolerance=1e-6)
    assert other.strain == pytest.approx(-one.strain) and other.finished
    assert other.stress == pytest.approx(-one.stress, rel=1e-6)
    assert other.work == pytest.approx(one.work, rel=1e-6)
    assert other.pressure == pytest.approx(one.pressure, rel=1e-6)


def test_parts_of_a_protocol_are_one_run(packing, tmp_path):
    parts = [(0.1, 0.04), (-0.1, 0.02), (0.01, 0.01)]
    run = jamlab.shear(packing, parts, rows=14, tolerance=1e-5)
    assert run.strain == pytest.approx(np.cumsum([0, *[0.005] * 8, *[-0.005] * 4, *[0.005] * 2]), abs=1e-12)
    assert run.path[-1] == pytest.approx(0.07) and run.finished and run.parts.tolist() == [list(p) for p in parts]
    assert run.time[-1] == pytest.approx(0.4 + 0.2 + 1.0)
    first = jamlab.shear(packing, 0.1, 0.04, rows=8, tolerance=1e-5)
    assert run.stress[:9] == pytest.approx(first.stress, rel=1e-6)
    assert [p.provenance["flow_strain"] for p in run.frames] == pytest.approx([0, 0.04, 0.02, 0.03], abs=1e-9)
    assert run.energy_error < 1e-5
    path = tmp_path / "run.h5"
    jamlab.shear(packing, parts, rows=14, tolerance=1e-5, path=path)
    read = jamlab.read_flow(path)
    assert read.parts.tolist() == run.parts.tolist() and read.stress == pytest.approx(run.stress, rel=1e-6)
    again = jamlab.shear(packing, parts, rows=14, tolerance=1e-5, path=path)
    assert np.array_equal(again.stress, read.stress)


def test_steady_averages_are_those_of_the_last_part(packing):
    run = jamlab.shear(packing, [(1.0, 0.5), (-1.0, 1.5)], rows=100)
    mean = run.steady(discard=0.5)
    assert (mean.stress < 0 and run.peak is None) or run.peak.strain <= 0.5
    kept = run.path >= 1.0 - 1e-9
    assert mean.stress == pytest.approx(np.diff(run.work[kept][[0, -1]])[0] / np.diff(run.strain[kept][[0, -1]])[0])


def test_a_flow_is_stopped_and_relaxes(packing):
    """Its result holds the state, the drag law with it."""
    run = jamlab.shear(packing, 0.05, 0.1, jamlab.StokesDrag(), rows=5)
    found = jamlab.stop_flow(run, 300.0)
    assert found.damping == run.damping and found.residual_stress == pytest.approx(run.elastic_stress[-1])
    assert found.strain == pytest.approx(0.0, abs=0) and found.time[0] == 0.0
    assert found.viscous_stress[-1] == pytest.approx(0.0, abs=1e-3 * abs(found.stress[0]))
    assert found.energy[-1] < found.energy[0] and found.energy_error < 1e-2
    again = jamlab.stop_flow(run.packing, 300.0, run.damping)
    assert np.array_equal(again.stress, found.stress) and found.plot().get_ylabel()


def test_what_relaxes_to_nothing_has_relaxed(tmp_path):
    """A box without shear stress, and disks that touch nobody."""
    still = jamlab.pack(n=8, pressure=1e-2, seed=8, ensemble="shear-stabilized")
    loose = still.with_state(box=2 * still.box, positions=2 * still.positions)
    for packing in (still, loose):
        found, again = (jamlab.stop_flow(packing, 20.0, path=tmp_path / f"{packing.phi:.2f}.h5") for _ in range(2))
        assert found.state == "relaxed" and np.abs(found.stress).max() < 1e-12
        assert np.array_equal(again.stress, found.stress)
    assert found.packing.positions == pytest.approx(loose.positions)
    assert jamlab.stop_flow(loose, 1e6).steps < 1000


@pytest.mark.parametrize(
    "answer",
    [
        lambda p: jamlab.creep(p, 1e-4, 10.0),
        lambda p: jamlab.oscillate(p, 1.0, 1e-3),
        lambda p: jamlab.relax_stress(p, 1e-4, 10.0),
    ],
)
def test_answers_of_what_is_not_at_rest_are_refused(flowing, answer):
    with pytest.raises(jamlab.ConvergenceError):
        answer(flowing)


def test_the_modulus_of_a_flowing_state_is_that_of_its_minimum(flowing):
    with pytest.raises(jamlab.ConvergenceError):
        jamlab.complex_modulus(flowing, [1.0])
    rest = jamlab.relax(flowing)
    assert jamlab.complex_modulus(rest, [1.0]).storage[0] > 0


def test_a_flow_has_a_fixed_box():
    """`relaxed` of a shear-stabilized packing shears the stress of a flow away."""
    packing = jamlab.pack(32, 1e-2, 1, ensemble="shear-stabilized")
    run = jamlab.shear(packing, 0.1, 0.3, rows=3)
    rest = jamlab.relax(run.packing)
    assert run.packing.ensemble == "fixed-box" and rest.box == pytest.approx(run.packing.box)


def _curve(packing, **how):
    return jamlab.flow_curve(packing, [0.5, 1.0], strain=1.0, discard=0.2, **how)


def _creep(packing, **how):
    return jamlab.creep(packing, 1e-4, 5.0, **how)


@pytest.mark.parametrize(("run", "rows"), [(_curve, "rate"), (_creep, "time")])
def test_what_ctrl_c_leaves_is_what_had_finished(run, rows, tmp_path):
    """Whole rates of a curve, and rows of a run in time; the same command goes on from them."""
    packing, file = jamlab.pack(32, 1e-2, 1), tmp_path / "run.h5"

    def stop(share, words):
        if share > 0.7:
            raise KeyboardInterrupt

    with pytest.MonkeyPatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr("jamlab.flow.run.RECORD", FileSteps(every=0.0))
        run(packing, path=file, progress=stop)
    kept, again, whole = jamlab.read_flow(file), run(packing, path=file), run(packing)
    count = len(getattr(kept, rows))
    assert 0 < count < len(getattr(whole, rows))
    known = np.flatnonzero(np.isin(getattr(again, rows), getattr(kept, rows)))
    assert len(known) == count and np.array_equal(again.stress[known], kept.stress)
    assert again.stress[-1] == pytest.approx(whole.stress[-1], rel=1e-3)


@pytest.mark.slow
def test_the_loss_of_droplets_is_the_work_of_a_cycle():
    droplets = jamlab.read(Path(__file__).parents[1] / "states" / "stable_droplets.h5")
    found = jamlab.oscillate(droplets, 0.1, 0.1, cycles=2, background_drag=1e-2)
    work = np.diff(found.work[:: found.points_per_cycle])
    assert np.pi * 0.1**2 * found.cycle_harmonics[:, 0].imag == pytest.approx(work, rel=1e-12)


def test_a_packing_of_other_sizes_goes_on_from_its_file(tmp_path):
    """Units of the engine round sizes, and a run was taken for another one."""
    packing = jamlab.pack(n=32, pressure=1e-2, seed=3)
    packing = packing.select(~jamlab.contacts(packing).rattlers)
    half, rest = (jamlab.shear(packing, 0.1, 0.02 * k, rows=2 * k, path=tmp_path / "r.h5") for k in (1, 2))
    assert np.array_equal(rest.stress[:3], half.stress) and np.array_equal(rest.packing.diameters, packing.diameters)
