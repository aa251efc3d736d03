"""Steady flow: averages, fits, files, plans, and flows that have no answer."""

from concurrent.futures import BrokenExecutor, Future
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from executors import InThisProcess

import jamlab
from jamlab.flow import flow_curve, overdamped_session
from jamlab.flow.flow_curve import require_time, steady_point
from jamlab.flow.overdamped_session import OverdampedSession
from jamlab.statistics.confidence import STANDARD_ERRORS
from jamlab.statistics.herschel_bulkley import herschel_bulkley


@pytest.fixture(scope="module")
def curve(disks, tmp_path_factory):
    """Two rates, and a third on top of the file; discarding no more than the averages need."""
    path = tmp_path_factory.mktemp("curve") / "curve.h5"
    shares = []
    how = {"strain": 1.0, "discard": 0.5, "path": path}
    two = jamlab.flow_curve(disks, [0.03, 0.3], progress=lambda share, _: shares.append(share), **how)
    three = jamlab.flow_curve(disks, [0.1, 0.3], **how)
    assert shares[-1] == pytest.approx(1.0) and shares == sorted(shares)
    return two, three, path


def test_flow_curve(curve, disks):
    two, three, path = curve
    assert three.rate.tolist() == [0.03, 0.1, 0.3]
    assert np.array_equal(three.stress[[0, 2]], two.stress)  # not run again
    assert np.all(np.diff(three.stress) > 0) and np.all(three.stress_stderr > 0.1 * three.stress)  # of a strain of 1
    assert np.all(three.elastic_stress < three.stress) and np.all(three.pressure > 0)
    assert three.dissipation == pytest.approx(three.stress * three.rate, rel=0.2)  # less what is stored
    assert len(three.packings) == 3 and np.array_equal(three.frames[0].positions, disks.positions)
    read = jamlab.read_flow(path)
    assert read.stress == pytest.approx(three.stress, abs=0) and repr(read) == repr(three)
    for z, error, packing in zip(
        read.z_all, read.z_all_stderr, read.packings, strict=True
    ):  # about that of the last state
        assert abs(z - jamlab.contacts(packing).z_all) < 0.5 and 0.05 < error < 2
    assert (three.state == "steady") == bool(three.finished.all())


def test_plastic_events_are_counted_per_strain_of_the_average(disks):
    """Three falls of the elastic stress, one of them in start-up: two in a strain of 0.1."""
    run = jamlab.shear(disks, 1.0, 0.2, rows=40)
    stress = np.arange(41) - 5.0 * np.sum(np.arange(41)[:, None] >= [11, 26, 36], axis=1)
    found = steady_point(replace(run, elastic_stress=stress), discard=0.1)
    assert found["plastic_events"] == pytest.approx(2 / 0.1)
    lost = np.diff(run.dissipated[run.strain > 0.0999][[0, -1]]) / 0.1  # in a time of 0.1, without start-up
    assert found["dissipation"] == pytest.approx(lost.item()) != pytest.approx(run.dissipated[-1] / 0.2, rel=1e-3)


def test_herschel_bulkley_finds_its_own_law():
    rng = np.random.default_rng(1)
    rates = np.geomspace(1e-5, 1e-1, 9)
    stress = 6e-4 + 0.1 * rates**0.5
    error = 0.02 * stress
    assert herschel_bulkley(rates, stress, error).exponent == pytest.approx(0.5, abs=1e-6)
    inside = 0
    for _ in range(40):
        fit = herschel_bulkley(rates, stress + error * rng.standard_normal(9), error)
        inside += abs(fit.exponent - 0.5) < STANDARD_ERRORS * fit.exponent_stderr
        assert fit(rates) == pytest.approx(stress, rel=0.2)
    assert inside >= 35
    assert "n = 0." in str(fit)
    with pytest.raises(jamlab.InputError):
        herschel_bulkley([1.0, 2.0], [1.0, 2.0], [1.0, 1.0])
    with pytest.raises(jamlab.InputError):
        herschel_bulkley([1.0, 2.0, 3.0], [1.0, 2.0, 3.0], [1.0, 0.0, 1.0])


def test_cost_says_what_does_not_fit(disks):
    cost = jamlab.flow_cost(disks, [1.0, 0.1], strain=4.0)
    assert cost["rate"].tolist() == [0.1, 1.0] and (cost["strain"] == 4.0).all() and (cost["seconds"] > 0).all()
    made = pd.DataFrame({"rate": [1e-5, 1e-4, 1e-3], "strain": 2.0, "seconds": [200.0, 20.0, 2.0]})
    require_time(made, 222.0)
    for given, fits in ((60.0, "0.54"), (1.0, "0.009")):
        with pytest.raises(jamlab.InputError) as refusal:
            require_time(made, given)
        assert "1e-05" in str(refusal.value) and fits in str(refusal.value)


def test_rates_that_finish_are_kept_where_another_fails(disks, monkeypatch, tmp_path):
    """The file knows the other one, and a new call tries again."""
    whole = flow_curve.shear

    def fails(packing, rate, *rest, **how):
        if rate == 1.0:
            raise jamlab.ConvergenceError("steps lead nowhere")
        return whole(packing, rate, *rest, **how)

    how = {"strain": 1.0, "discard": 0.2, "path": tmp_path / "c.h5"}
    with monkeypatch.context() as patch:
        patch.setattr(flow_curve, "shear", fails)
        part = jamlab.flow_curve(disks, [0.5, 1.0], **how)
        with pytest.raises(jamlab.ConvergenceError):
            jamlab.flow_curve(disks, [1.0], strain=1.0, discard=0.2)
    assert part.rate.tolist() == [0.5] and part.failed == {"1": "steps lead nowhere"}
    assert part.failed["1"] in part.conclusion
    assert jamlab.read_flow(tmp_path / "c.h5").failed == part.failed
    assert jamlab.flow_curve(disks, [0.5, 1.0], **how).rate.tolist() == [0.5, 1.0]


def test_rates_are_stored_as_they_come_from_an_executor(disks, tmp_path):
    """Its workers are lost at the second rate; a new call measures that one, and finds the bits of one process."""

    class Lost(InThisProcess):
        calls = 0

        def submit(self, function, /, *arguments):
            self.calls += 1
            future = super().submit(function, *arguments) if self.calls == 1 else Future()
            if self.calls > 1:
                future.set_exception(BrokenExecutor("gone"))
            return future

    how = {"strain": 1.0, "discard": 0.2, "path": tmp_path / "c.h5"}
    shares = []
    with pytest.raises(jamlab.EngineError, match="Lost broke"):
        jamlab.flow_curve(disks, [0.5, 1.0], workers=Lost(), progress=lambda share, _: shares.append(share), **how)
    assert len(jamlab.read_flow(how["path"]).rate) == 1 and len(shares) > 10 and shares[-1] == pytest.approx(0.5)
    found = jamlab.flow_curve(disks, [0.5, 1.0], workers=InThisProcess(), **how)
    wanted = jamlab.flow_curve(disks, [0.5, 1.0], strain=1.0, discard=0.2)
    assert found.rate.tolist() == [0.5, 1.0] and found.stress.tobytes() == wanted.stress.tobytes()
    assert [p.positions.tobytes() for p in found.packings] == [p.positions.tobytes() for p in wanted.packings]


def change_steps(monkeypatch, **numbers):
    monkeypatch.setattr(overdamped_session, "STEPS", replace(overdamped_session.STEPS, **numbers))


@pytest.mark.parametrize(
    ("call", "remedy"),
    [
        (lambda p: jamlab.shear(p, 1e-12, 1e-3), "rate than 1e-12"),
        (lambda p: jamlab.shear(p, [(1.0, 1e-3), (-1e-9, 1.0)]), "rate than 1e-09"),
        (lambda p: jamlab.shear(p, 1.0, 1.0, jamlab.ContactDamping(tau=1e-9)), "rate than 1"),
        (lambda p: jamlab.shear(p, 1e-8, 1.0, jamlab.StokesDrag()), "rate than 1e-08"),
        (lambda p: jamlab.oscillate(p, 1e-8, 1e-3), "omega than 1e-08"),
        (lambda p: jamlab.relax_stress(p, 1e-3, 1e12), "duration than 1e+12"),
        (lambda p: jamlab.creep(p, 1e-4, 1e12), "duration than 1e+12"),  # might as well have flowed to its last strain
    ],
)
def test_a_run_that_would_never_end_is_given_up(disks, monkeypatch, call, remedy):
    change_steps(monkeypatch, look=200)
    with pytest.raises(jamlab.ConvergenceError) as refusal:
        call(disks)
    assert remedy in str(refusal.value)


def test_a_flow_that_crawls_is_given_up_with_a_remedy(disks, monkeypatch):
    """Motion that costs hardly any drag makes steps short; here every flow is said to crawl."""
    change_steps(monkeypatch, look=10)
    change_steps(monkeypatch, crawl=(1e3, 1e3))
    for given, more in (
        (0.0, "background_drag = 0.01 "),
        (None, "background_drag = 0.01 "),
        (0.1, "background_drag = 1 "),
    ):
        with pytest.raises(jamlab.ConvergenceError) as refusal:
            jamlab.shear(disks, 0.1, rows=1, background_drag=given)
        assert more in str(refusal.value)


def test_steps_that_remain_are_counted_in_every_cycle(disks, monkeypatch):
    """An oscillation that is given up in its fourth cycle names no negative number of steps."""
    change_steps(monkeypatch, look=10)

    def give_up(share, _):
        if share >= 0.75:
            change_steps(monkeypatch, most=1.0)

    with pytest.raises(jamlab.ConvergenceError, match=r": at least \d[.e+\d]* more would be needed"):
        jamlab.oscillate(disks, 1.0, 0.2, cycles=4, points_per_cycle=16, tolerance=1e-4, progress=give_up)


def test_steps_that_are_short_for_a_reason_are_no_crawl(disks, monkeypatch):
    """Those that rows or a fine tolerance make short; and power laws make few that are long."""
    change_steps(monkeypatch, look=100)
    assert jamlab.shear(disks, 1.0, 1e-4, rows=300).steps == 300
    assert jamlab.shear(disks, 0.01, 0.01, rows=2, tolerance=1e-9).steps > 1000
    assert jamlab.shear(disks, 1e-12, 1e-3, jamlab.ContactDamping(alpha=0.5), rows=2).balanced


def test_a_solver_that_fails_says_where(disks):
    with OverdampedSession(disks, jamlab.ContactDamping(), 1e-6, 0.0) as session:
        with pytest.raises(jamlab.ConvergenceError) as refusal:
            session.drive("rate 1 iterations 3", 1.0)
    assert "background" in str(refusal.value)


@pytest.mark.parametrize(
    "how", [{"rates": []}, {"rates": [0.0]}, {"rates": [1.0], "strain": 0.1}, {"rates": [1.0], "workers": 0}]
)
def test_refused(disks, how):
    with pytest.raises(jamlab.InputError) as refusal:
        jamlab.flow_curve(disks, **how)
    assert str([*how.values()][-1]) in str(refusal.value)


def test_files_that_hold_no_flow_are_refused(disks, tmp_path):
    jamlab.write(tmp_path / "p.h5", disks)
    with pytest.raises(jamlab.StorageError):
        jamlab.read_flow(tmp_path / "p.h5")
    with pytest.raises(jamlab.StorageError):
        jamlab.shear(disks, 0.1, path=tmp_path / "none" / "run.h5")
