"""Flow of disks against plain numpy, where drag sets in over a thin layer of overlap: tolerance means error."""

from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd
import pytest
from plain_flow import PlainFlow

import jamlab
from jamlab.flow import shear as shear_module
from jamlab.flow.run import write_result
from jamlab.protocols.random_start import random_disks

LAWS = {  # as PlainFlow and jamlab take them
    "contact": ({}, jamlab.ContactDamping()),
    "stokes": ({"contacts_drag": False}, jamlab.StokesDrag(eta_f=0.0)),
    "power law": ({"alpha": 0.5}, jamlab.ContactDamping(alpha=0.5)),
}


@pytest.fixture(scope="module")
def packing():
    return jamlab.pack(16, 1e-2, 3)


def errors(run, stress):
    """Of the stress in each row, over the largest stress."""
    return np.abs(run.stress - stress) / np.abs(stress).max()


LONG = {"power law": pytest.mark.slow}  # the linear laws have the same contacts to follow


@pytest.mark.parametrize(
    ("law", "rate"),
    [
        pytest.param("contact", 1.0, marks=pytest.mark.slow),
        *(pytest.param(law, 0.1, marks=LONG.get(law, ())) for law in LAWS),
    ],
)
def test_errors_stay_below_the_tolerance(packing, law, rate):
    """Contacts open, close and rub on the way: drag then acts in part."""
    how, damping = LAWS[law]
    stress, pressure, n1, contacts, rubbing = PlainFlow(packing, **how).rows(rate, 0.1, 25)
    assert np.ptp(contacts) > 2 and (rubbing.any() or rate == 1.0 or law == "stokes")
    for tolerance in (1e-2, 1e-3, 1e-4):
        run = jamlab.shear(packing, rate, 0.1, damping, rows=25, tolerance=tolerance)
        off = errors(run, stress)
        assert np.sum(off > 10 * tolerance) <= 1 and np.median(off) < tolerance
        assert run.energy_error < tolerance
    assert run.contacts == pytest.approx(contacts, abs=0)
    assert run.pressure == pytest.approx(pressure, rel=1e-3)
    assert run.normal_stress_difference == pytest.approx(n1, abs=1e-3 * np.abs(n1).max())


@pytest.mark.slow
def test_creep_is_that_of_plain_numpy(packing):
    """At a stress that moves contacts."""
    run = jamlab.creep(packing, 0.02, 4.0, tolerance=1e-4, background_drag=1e-4)
    strain = PlainFlow(packing, layer=1e-6).creep(run.residual_stress + 0.02, run.time)
    assert np.ptp(run.contacts) > 2
    assert run.strain == pytest.approx(strain, abs=1e-4 * strain[-1])


@pytest.mark.parametrize(("seed", "rate"), [(2, 0.1), (1, 1e-4)])
@pytest.mark.slow
def test_power_laws_flow_below_jamming(seed, rate):
    """Contacts come and go one by one: some stand still, where such drag over velocity has no limit, and some rub."""
    packing, law = jamlab.relax(random_disks(64, seed, phi=0.8, units="k")), LAWS["power law"][1]
    run = jamlab.shear(packing, rate, 0.05, law, rows=5)
    assert run.finished and run.balanced


@pytest.mark.parametrize(("n", "seed", "rate"), [(16, 3, 1e-2), pytest.param(16, 2, 0.1, marks=pytest.mark.slow)])
def test_power_laws_below_jamming_are_exact(n, seed, rate):
    law = LAWS["power law"][1]
    start = jamlab.relax(random_disks(n, seed, phi=0.8, units="k"))
    packing = jamlab.shear(start, rate, 0.5, law, rows=2, background_drag=1e-2).packing
    stress, *_ = PlainFlow(packing, alpha=0.5, background=1e-2).rows(rate, 0.05, 20)
    run = jamlab.shear(packing, rate, 0.05, law, rows=20, background_drag=1e-2, tolerance=1e-4)
    assert errors(run, stress).max() < 2e-4


@pytest.mark.parametrize("exponent", [pytest.param(2.5, marks=pytest.mark.slow), 3.0])
def test_drag_that_sets_in_from_nothing_is_exact(exponent):
    """Contacts stiffen from 0 on; a disk that presses on one alone turns and slips within a thin layer."""
    packing, background = jamlab.pack(8, 1e-3, 2, law={"exponent": exponent}), 1e-4
    for rate in (0.1, -0.05):
        stress, pressure, *_ = PlainFlow(packing, background=background).rows(rate, np.copysign(0.3, rate), 30)
        for tolerance in (1e-2, 1e-4):
            run = jamlab.shear(packing, rate, 0.3, rows=30, tolerance=tolerance, background_drag=background)
            off = errors(run, stress)
            assert np.sum(off > 10 * tolerance) <= 1 and np.median(off) < 0.1 * tolerance
        assert run.pressure == pytest.approx(pressure, rel=1e-3)


@pytest.mark.parametrize(("n", "seed", "exponent", "strain"), [(16, 4, 2.5, 1.0), (32, 3, 3.0, 5.0)])
def test_stiffening_disks_flow(n, seed, exponent, strain):
    """At strains where disks hang on one thin contact, which gave steps of 1e-5 or no number at all."""
    run = jamlab.shear(jamlab.pack(n, 1e-3, seed, law={"exponent": exponent}), 0.1, strain, rows=50)
    assert run.finished and run.balanced and run.steps < 5000 * strain
    assert all(np.isfinite(getattr(run, name)).all() for name in ("stress", "pressure", "dissipation"))


def test_gaps_of_pairs_that_rub_close(packing):
    """A pair is caught a little off a gap of zero, and comes to it while it slips: from strain 0.080 to 0.096."""
    run, plain = jamlab.shear(packing, 0.1, 0.1, rows=25, tolerance=1e-2, snapshot_every=0.004), PlainFlow(packing)
    gaps = np.abs([plain.gaps(p.positions, p.box[1, 0] / p.box[1, 1]) for p in run.frames[21:24:2]])
    first, later = gaps[:, gaps[1].argmin()]
    assert first < 1e-5 and later < 0.95 * first


def test_motion_without_drag_is_forgotten():
    """Below jamming nothing takes it away, and a flow goes as one that starts from its positions."""
    start = jamlab.relax(random_disks(16, 4, phi=0.82, units="k"))
    flow = partial(jamlab.shear, rate=0.1, background_drag=0.0, tolerance=1e-4)
    whole, half = flow(start, strain=0.2, rows=20), flow(start, strain=0.1, rows=10)
    again = flow(half.packing, strain=0.1, rows=10)
    assert again.packing.positions == pytest.approx(whole.packing.positions, abs=1e-5)


def test_a_gap_that_is_wide_again_is_told_by_itself():
    """Two pairs decide on each other at strain 0.0459; the one that opens then came back under its drag, and pulled."""
    packing = jamlab.pack(32, 1e-2, 1)
    coarse, fine = (jamlab.shear(packing, 0.1, 0.102, rows=34, tolerance=tolerance) for tolerance in (1e-3, 1e-5))
    assert errors(coarse, fine.stress).max() < 1e-3
    assert coarse.ambiguous_contacts == fine.ambiguous_contacts == 0


def test_states_that_were_guessed_are_counted(packing, tmp_path):
    run = jamlab.shear(packing, 0.1, 0.02, rows=2)
    guessed = replace(run, ambiguous_contacts=3)
    assert repr(guessed) != repr(run)
    write_result(tmp_path / "run.h5", guessed)
    assert jamlab.read_flow(tmp_path / "run.h5").ambiguous_contacts == 3


def test_the_error_of_a_trajectory_is_measured_beside_the_run():
    """Near onset the order of contacts decides: stresses are far off though energy is balanced, and the run beside
    at a tenth of the tolerance says how far."""
    p, how = jamlab.pack(32, 1e-3, 12), {"rate": 0.03, "strain": 0.1, "rows": 20}
    run = jamlab.shear(p, **how, trajectory_error=True)
    exact = jamlab.shear(p, **how, tolerance=1e-6)
    off = errors(run, exact.stress)
    assert run.balanced and off.max() > 3 * run.tolerance
    assert 0.5 * off.max() < run.relative_trajectory_error < 2 * off.max()
    assert run.trajectory_error[0] < 1e-9 and np.all(np.diff(run.trajectory_error) >= 0)
    finer = jamlab.shear(p, **how, tolerance=0.1 * run.tolerance)
    apart = np.maximum.accumulate(np.abs(run.stress - finer.stress))
    assert run.trajectory_error == pytest.approx(apart, rel=1e-6, abs=1e-9 * apart.max())
    assert run.to_dataframe()["trajectory_error"].equals(pd.Series(run.trajectory_error))
    assert "error of the trajectory" in repr(run) and "error of the trajectory" not in repr(exact)
    assert np.isnan(exact.relative_trajectory_error)


def test_every_flow_measures_its_trajectory_and_its_file_keeps_that(packing, tmp_path):
    path = tmp_path / "run.h5"
    plain = jamlab.shear(packing, 1.0, 0.02, rows=4, path=path)
    run = jamlab.shear(packing, 1.0, 0.02, rows=4, path=path, trajectory_error=True)
    again = jamlab.shear(packing, 1.0, 0.02, rows=4, path=path)  # complete: the file says all
    assert len(plain.trajectory_error) == 0 and len(run.trajectory_error) == 5
    assert np.array_equal(again.trajectory_error, run.trajectory_error)
    assert np.array_equal(jamlab.read_flow(path).trajectory_error, run.trajectory_error)
    other = [
        jamlab.oscillate(packing, 1.0, 1e-3, cycles=2, trajectory_error=True),
        jamlab.creep(packing, 1e-5, 2.0, trajectory_error=True),
        jamlab.relax_stress(packing, 1e-4, 2.0, trajectory_error=True),
        jamlab.stop_flow(run, 2.0, trajectory_error=True),
    ]
    for each in other:
        assert len(each.trajectory_error) == len(each.time) and each.relative_trajectory_error < 0.05
    with pytest.raises(jamlab.InputError, match="tolerance = 1e-09"):
        jamlab.shear(packing, 1.0, 0.02, tolerance=1e-9, trajectory_error=True)


def test_a_run_is_kept_if_the_one_beside_it_fails(packing, monkeypatch):
    def fail(*_, **__):
        raise jamlab.ConvergenceError("no steps")

    begun = shear_module.TimedRun.measure_trajectory_error
    monkeypatch.setattr(shear_module.TimedRun, "measure_trajectory_error", lambda flow, _: begun(flow, fail))
    with pytest.warns(jamlab.JamlabWarning, match="no steps"):
        run = jamlab.shear(packing, 1.0, 0.02, rows=4, trajectory_error=True)
    assert run.finished and len(run.trajectory_error) == 0
