"""One tolerance, from the caller down to LAMMPS and into the record; what a state knows about its minimum."""

import numpy as np
import pytest

import jamlab
from jamlab.engine.deck_defaults import defaults
from jamlab.engine.session import Session
from jamlab.packing.deformation import at_phi, sheared
from jamlab.protocols.box_shear import relax_with_box_shear
from jamlab.protocols.relaxation import force_tolerance, relax

LOOSE, TIGHT = 1e-9, 1e-13


@pytest.fixture(scope="module")
def onset():
    return {tolerance: jamlab.jam(n=16, seed=1, tolerance=tolerance) for tolerance in (LOOSE, TIGHT)}


def _made(onset, kind, tolerance):
    if kind == "jam":
        return onset[tolerance]
    if kind == "compress":
        return next(jamlab.compress(onset[tolerance], to=0.9, step=0.1, tolerance=tolerance))
    if kind == "stabilized":
        return jamlab.pack(n=16, pressure=1e-2, seed=1, ensemble="shear-stabilized", tolerance=tolerance)
    return jamlab.pack(n=16, pressure=1e-2, seed=1, tolerance=tolerance)


@pytest.mark.parametrize("kind", ["jam", "compress", "pack", "stabilized"])
def test_the_tolerance_asked_for_is_met_and_recorded(onset, kind):
    for tolerance in (LOOSE, TIGHT):
        p = _made(onset, kind, tolerance)
        assert p.converged and p.provenance["force_tolerance"] == tolerance
        assert p.max_force <= tolerance
        assert jamlab.evaluate(p).max_force == pytest.approx(p.max_force, abs=1e-14)


def test_the_tolerance_is_a_norm_that_lammps_gets_halved_once(onset, monkeypatch):
    """Of every call of `Session.minimize`: LAMMPS compares components."""
    asked, lines = [], []
    minimize, command = Session.minimize, Session.command
    monkeypatch.setattr(
        Session, "minimize", lambda self, force, **how: asked.append(force) or minimize(self, force, **how)
    )
    monkeypatch.setattr(Session, "command", lambda self, line: lines.append(line) or command(self, line))
    next(jamlab.compress(onset[LOOSE], to=0.9, step=0.1, tolerance=3e-8))
    assert set(asked) == {3e-8}
    assert {float(line.split()[2]) for line in lines if line.startswith("minimize ")} == {1.5e-8}


@pytest.mark.parametrize("minimizer", [relax, relax_with_box_shear])
def test_both_minimisers_take_and_record_it(minimizer):
    p = next(jamlab.compress(jamlab.jam(n=16, seed=1), to=0.9, step=0.1))
    with Session(at_phi(p, p.phi + 1e-3)) as session:
        found = minimizer(session, 1e-7)
        assert found.converged and found.tolerance == 1e-7 and found.evaluation.max_force <= 1e-7
        found = minimizer(session, near=True)
        assert found.tolerance == force_tolerance("sp") == defaults("sp.minimum")["force"]


def test_droplets_take_it(dp_onset):
    (p,) = jamlab.compress(dp_onset, to=dp_onset.onset + 0.01, step=0.1, by="phi", tolerance=1e-8)
    assert p.converged and 1e-10 < p.max_force <= 1e-8 and p.provenance["force_tolerance"] == 1e-8
    assert dp_onset.provenance["force_tolerance"] == force_tolerance("dp")


@pytest.mark.parametrize("value", [0, -1e-9, float("nan"), 1e-16, 1e-2, "1e-9", True])
def test_tolerances_that_are_none(onset, value):
    for run in (
        lambda: jamlab.jam(n=8, tolerance=value),
        lambda: jamlab.compress(onset[LOOSE], to=0.9, tolerance=value),
        lambda: jamlab.pack(n=8, pressure=1e-2, tolerance=value),
        lambda: jamlab.to_polygons(onset[LOOSE], tolerance=value),
    ):
        with pytest.raises(jamlab.InputError, match="tolerance"):
            run()


def test_a_tolerance_that_is_not_small_beside_the_pressure_is_refused():
    with pytest.raises(jamlab.InputError, match=r"pressure = 1e-06.*1e-09.*1e-05"):
        jamlab.pack(n=8, pressure=1e-6, tolerance=1e-9)


def test_a_paper_search_with_a_step_below_its_end_is_refused():
    with pytest.raises(jamlab.InputError, match="step = 1e-13: the search ends at 1e-12"):
        jamlab.jam(n=8, search="paper", step=1e-13)


def test_what_moves_particles_or_the_box_clears_the_mark(onset):
    p = onset[LOOSE]
    moved = [
        at_phi(p, 0.9),
        sheared(p, 1e-3),
        p.with_state(positions=p.positions + 1e-9),
        p.with_state(params={"eps": 2.0}),
        p.with_state(diameters=1.1 * p.diameters),
    ]
    for q in moved:
        assert not q.converged and q.max_force is None
        assert "converged" not in q.provenance and "max_force" not in q.provenance
        assert q.provenance["seed"] == 1 and q.ensemble == p.ensemble
    assert p.with_state(onset=0.8).converged and p.with_state(provenance={"note": "kept"}).max_force == p.max_force


def test_state_of_the_minimum_is_checked(onset):
    p = onset[LOOSE]
    for wrong in ({"converged": 1}, {"max_force": -1.0}, {"max_force": "small"}, {"ensemble": "npt"}):
        with pytest.raises(jamlab.InputError, match=next(iter(wrong))):
            p.with_state(**wrong)


def test_state_of_the_minimum_goes_through_files(tmp_path):
    p = jamlab.pack(n=8, pressure=1e-2, seed=1, ensemble="shear-stabilized")
    loose = at_phi(p, 0.9)
    jamlab.write(tmp_path / "two.h5", [p, loose])
    first, second = jamlab.read_all(tmp_path / "two.h5")
    assert (first.ensemble, first.converged, first.max_force) == ("shear-stabilized", True, p.max_force)
    assert (second.ensemble, second.converged, second.max_force) == ("shear-stabilized", False, None)
    assert first.provenance == p.provenance and second.provenance == loose.provenance
    np.testing.assert_array_equal(first.positions, p.positions)
