"""Plastic events: brackets, what each event changes, the mode that softens, the distribution of sizes."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from own_enthalpy import own_changes, own_second_derivatives
from own_motion import own_local_strain

import jamlab
from jamlab import quasistatic_shear
from jamlab.flow.softening import _fitted
from jamlab.mechanics.enthalpy_modes import lowest_of_enthalpy

EVENT = 0.029258  # strain of the first event of the packing below, in its first direction


@pytest.fixture(scope="module")
def start():
    """Just before an event."""
    return quasistatic_shear(jamlab.pack(32, 1e-2, seed=3), 0.0285, strain_step=9.5e-3).packing


@pytest.fixture(scope="module")
def run(start):
    return quasistatic_shear(start, 1e-3, event_width=1e-5)


def bare(packing):
    """The same state, as if nothing were known of it."""
    return packing.with_state(positions=packing.positions.copy())


def test_an_event_is_bracketed_whatever_the_step(start, run):
    """Its sides are minima at the strains of their rows, the nearer one of which leads back."""
    fine = quasistatic_shear(start, 1e-3, strain_step=5e-4, event_width=1e-5)
    assert len(run.events) == len(fine.events) == 1
    assert run.events.width[0] <= 1e-5 and abs(run.events.strain[0] - fine.events.strain[0]) <= 1e-5
    assert run.events.strain[0] + 0.0285 == pytest.approx(EVENT, abs=1e-5)
    assert run.events.energy[0] == pytest.approx(fine.events.energy[0], rel=1e-2)
    (before,), (after,) = run.events.before, run.events.after
    row = int(np.flatnonzero(run.event)[0])
    for packing, k in ((before, row - 1), (after, row)):
        assert packing.provenance["flow_strain"] == run.strain[k] and packing.converged
        assert jamlab.evaluate(packing).energy / packing.area == pytest.approx(run.energy[k], rel=1e-12)
    assert run.inner_rows.tolist() == [row - 1, row] and run.strain[-1] == 1e-3
    back = quasistatic_shear(after, -run.events.width[0], strain_step=run.events.width[0]).packing
    assert jamlab.evaluate(back).energy < jamlab.evaluate(before).energy - 0.9 * run.events.energy[0]


def test_all_of_the_energy_lost_is_lost_in_the_event(run):
    lost = np.diff(run.dissipated, prepend=0.0)
    assert run.events.released[0] == lost[run.event][0] > 1e3 * abs(lost[~run.event]).max()
    assert run.events.energy[0] == pytest.approx(run.events.released[0] * run.area[0], rel=1e-12)


def test_changes_of_an_event_agree_with_plain_numpy(run):
    (before,), (after,), events = run.events.before, run.events.after, run.events
    lost, gained = own_changes(before, after)
    held = [~jamlab.contacts(state).rattlers for state in (before, after)]
    assert events.contacts_lost[0] == sum(held[0][list(pair)].all() for pair in lost) > 0
    assert events.contacts_gained[0] == sum(held[1][list(pair)].all() for pair in gained) > 0
    found = jamlab.local_strain(before, after)
    d2min = found.d2min[np.isfinite(found.d2min)]
    assert events.participation[0] == pytest.approx(d2min.sum() ** 2 / (d2min**2).sum(), rel=1e-10)
    own = own_local_strain(before, after, 1.6)[0]
    known = np.isfinite(jamlab.local_strain(before, after, 1.6).d2min)
    assert jamlab.local_strain(before, after, 1.6).d2min[known] == pytest.approx(own[known], rel=1e-10, abs=1e-16)
    assert events.t1[0] == len(jamlab.t1_events([before, after]))
    assert events.kind[0] == ("T1" if events.t1[0] else "contact change")
    assert {"kind", "participation", "t1"} < {*events.to_dataframe().columns}


def test_a_run_that_was_stopped_goes_on(start, run, tmp_path):
    quasistatic_shear(start, 5e-4, event_width=1e-5, strain_step=2.5e-4, path=tmp_path / "run.h5")
    found = quasistatic_shear(start, 1e-3, event_width=1e-5, strain_step=2.5e-4, path=tmp_path / "run.h5")
    whole = quasistatic_shear(start, 1e-3, event_width=1e-5, strain_step=2.5e-4)
    assert len(found.events) == 1 and found.strain.tolist() == whole.strain.tolist()
    assert found.stress == pytest.approx(whole.stress, abs=1e-11)
    assert found.inner_rows.tolist() == whole.inner_rows.tolist()
    kept = jamlab.read_flow(tmp_path / "run.h5")
    assert kept.events.before[0] == whole.events.before[0] and kept.event_width == 1e-5


def test_means_leave_out_rows_within_steps(run):
    """And so do velocity profiles: a bracket has no strain to divide by."""
    rows = np.setdiff1d(np.arange(len(run.strain)), run.inner_rows)
    assert run.strain[rows] == pytest.approx([0, 1e-3], abs=1e-12)
    profile = run.velocity_profile
    assert len(run.frames) == 4 and np.abs(profile.velocity).max() < 10
    assert profile.velocity.tolist() == replace(run, frames=(run.frames[0], run.frames[-1]), kept_rows=rows[[0, -1]],
                                                inner_rows=rows[:0]).velocity_profile.velocity.tolist()  # fmt: skip
    p = jamlab.pack(16, 1e-2, seed=3)
    plain, found = (quasistatic_shear(p, 0.04, 2e-3, event_width=width) for width in (None, 1e-5))
    on_grid = np.setdiff1d(np.arange(len(found.strain)), found.inner_rows)
    assert len(found.inner_rows) and found.strain[on_grid] == pytest.approx(plain.strain, abs=1e-12)
    assert found.steady(1e-3).stress == pytest.approx(found.stress[on_grid][2:].mean(), rel=1e-12)
    assert found.steady(1e-3).stress == pytest.approx(plain.steady(1e-3).stress, rel=1e-3)


@pytest.mark.parametrize("seed", range(10))
def test_modes_of_the_enthalpy_agree_with_plain_numpy(seed):
    power = 2.0 + 0.5 * (seed % 2)
    p = jamlab.pack(8, 0.05, seed, law={"exponent": power})
    held = np.repeat(~jamlab.contacts(p).rattlers, 2)
    pressure = jamlab.evaluate(p).pressure
    for given in (None, pressure):
        own = own_second_derivatives(p, 1.0, power, given)
        kept = np.concatenate([held, np.ones(int(given is not None), dtype=bool)])
        values = np.linalg.eigvalsh(own[np.ix_(kept, kept)])
        values = values[np.abs(values) > 1e-9][:3]
        found, vectors = lowest_of_enthalpy(p, 3, given)
        assert found == pytest.approx(values, rel=1e-10, abs=1e-12)
        assert (vectors**2).sum(axis=1) == pytest.approx(np.ones(len(found)), rel=1e-12)


def test_the_series_finds_a_fold_and_nothing_else():
    """Of a cubic potential, with higher orders: lambda = a x^(1/2) + b x."""
    distance = 1e-6 * np.append(0.0, 2.0 ** np.arange(13))
    x = distance + 3e-7
    law = _fitted(distance, 0.2 * np.sqrt(x) + 0.7 * x, 1e-6)
    assert law["ending"] == "fold" and law["ahead"] == pytest.approx(3e-7, rel=1e-3)
    assert law["prefactor"] == pytest.approx(0.2, rel=1e-3) and law["prefactor_stderr"] < 1e-3
    assert law["exponent"] == pytest.approx(0.5, abs=0.02)
    assert _fitted(distance, 0.02 + 0.3 * distance, 1e-6)["ending"] == "contact change"
    assert _fitted(distance, x**0.3, 1e-6)["ending"] == "unresolved"
    assert _fitted(distance[:4], np.sqrt(x[:4]), 1e-6)["ending"] == "unresolved"


def test_a_harmonic_contact_that_changes_ends_a_minimum_at_once(run):
    soft = jamlab.softening(run, -1)
    assert soft.ending == "contact change" and np.isnan(soft.critical_strain) and soft.eigenvalues[0] > 1e-3
    p = soft.packing
    own = own_second_derivatives(p, 1.0, 2.0)
    assert (soft.vector.ravel() @ own @ soft.vector.ravel()) == pytest.approx(soft.eigenvalues[0], rel=1e-9)
    assert not soft.vector[jamlab.contacts(p).rattlers].any() and soft.vector.sum(axis=0) == pytest.approx(0, abs=1e-9)


@pytest.mark.slow
def test_the_softest_mode_vanishes_as_the_root_of_the_distance():
    """Where no contact changes on the way: dense disks."""
    run = quasistatic_shear(jamlab.pack(64, 0.1, seed=1), 0.058, event_width=1e-6)
    soft = jamlab.softening(run, -1)
    assert soft.ending == "fold" and soft.exponent == pytest.approx(0.5, abs=0.01)
    assert run.events.strain[-1] - 1e-6 < soft.critical_strain <= run.events.strain[-1]
    assert soft.prefactor_stderr < 1e-3 * soft.prefactor and soft.critical_strain_stderr < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize(
    "how", [{}, {"pressure": "constant"}, {"direction": "pure"}, {"direction": 0.5}, {"strain": [0.02, -0.04, 0.0]}]
)
def test_events_of_two_steps_agree_to_the_width(how):
    p, how = jamlab.pack(32, 1e-2, seed=3), {"strain": 0.06, "event_width": 1e-6} | how
    found = [quasistatic_shear(p, strain_step=step, **how).events for step in (1e-3, 2.5e-4)]
    assert len(found[0]) == len(found[1]) > 0
    assert np.abs(found[0].strain - found[1].strain).max() <= 1e-6
    assert found[0].energy == pytest.approx(found[1].energy, rel=1e-3)


def test_the_exponent_of_sizes_has_an_interval_over_packings():
    """Of a power law, from rows of a campaign."""
    rng = np.random.default_rng(2)
    rows = [
        {"task": f"t{k}", "seed": k, "state": 0, "strain": strain, "energy": energy, "n": 32}
        for k in range(20)
        for strain, energy in zip(rng.random(30), 1e-4 * (1 - rng.random(30)) ** (-1 / 0.5), strict=True)
    ]
    found = jamlab.event_sizes(pd.DataFrame(rows), least_size=1e-4, truncated=False)
    assert found.packings == 20 and found.fitted == len(found.sizes) == 600
    assert found.exponent == pytest.approx(1 + 600 / np.log(found.sizes / 1e-4).sum(), rel=1e-12)
    assert found.exponent_low < 1.5 < found.exponent_high and found.exponent_high - found.exponent_low < 0.2
    late = jamlab.event_sizes(pd.DataFrame(rows), least_size=1e-4, truncated=False, discard=0.5)
    assert 200 < len(late.sizes) < 400
    with pytest.raises(jamlab.InputError, match=r"several kinds: n = .*select"):
        jamlab.event_sizes(pd.DataFrame([*rows, rows[0] | {"n": 64}]))
    with pytest.raises(jamlab.InputError, match=r"event_sizes: seed 0 has 2 tasks.*one sweep"):
        jamlab.event_sizes(pd.DataFrame([*rows, rows[0] | {"task": "again"}]))


def refused(call, *words):
    with pytest.raises(jamlab.InputError) as error:
        call()
    assert all(word in str(error.value) for word in words), str(error.value)


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ({"event_width": 1e-3}, ("event_width = 0.001", "strain_step = 0.001")),
        ({"event_width": 1e-15}, ("event_width = 1e-15", "larger width")),
        ({"event_width": 1e-9, "force_tolerance": 1e-9}, ("event_width = 1e-09", "force_tolerance below 1e-09")),
        ({"event_width": 0.0}, ("event_width", "0")),
        ({"event_width": -1e-6}, ("event_width", "-1e-06")),
        ({"event_width": "1e-6"}, ("event_width", "'1e-6'")),
        ({"event_width": float("nan")}, ("event_width", "nan")),
        ({"event_width": 1e-6, "strain": 1000.0, "strain_step": 0.1, "until_jammed": True}, ("until_jammed", "jammed")),
    ],
)
def test_widths_that_no_run_can_have_are_refused(start, how, words):
    refused(lambda: quasistatic_shear(start, **{"strain": 1e-3} | how), *words)


def test_what_events_cannot_say_is_refused(start, run):
    plain = quasistatic_shear(start, 1e-3)
    assert len(plain.events) == 1 and "kind" not in plain.events.to_dataframe()
    refused(lambda: plain.events.participation, "event_width=1e-6")
    refused(lambda: jamlab.softening(plain), "event_width")
    refused(lambda: jamlab.softening(run, 3), "event = 3", "1 events")
    refused(lambda: jamlab.event_sizes([run]), "1 sizes", "10 or more")
    refused(lambda: jamlab.event_sizes([run, run]), "runs[0]", "runs[1]", "leave one out")
    refused(lambda: jamlab.event_sizes([]), "runs", "one or more")
    refused(lambda: jamlab.event_sizes(run, select={"n": 3}), "select", "campaign")
    refused(lambda: jamlab.event_sizes(run, "drop"), "quantity", "'drop'", "stress_drop")
    refused(lambda: jamlab.event_sizes(run, discard=-1.0), "discard", "-1")
    refused(lambda: jamlab.event_sizes(run, least_size=0.0), "least_size", "0")
