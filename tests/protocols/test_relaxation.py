"""The minimiser of shapes: descent and what it undoes, its tolerance down to LAMMPS and the record."""

from dataclasses import astuple

import numpy as np
import pytest

import jamlab
from jamlab.engine.session import Session
from jamlab.packing.deformation import at_phi, sheared
from jamlab.protocols import descent as steps
from jamlab.protocols import descent_of_droplets, newton, newton_with_box, relaxation
from jamlab.protocols.descent_of_droplets import LOOSE_FORCE, undo_if_folded
from jamlab.protocols.newton import NEWTON
from jamlab.protocols.preconditioned_lbfgs import FAR
from jamlab.protocols.relaxation import relax_session, settle, usual_force_tolerance
from jamlab.protocols.saddles import SLIDES


def idle(session, *_):
    """In place of a minimiser that must not be needed."""
    return session.evaluate()


def descent(session, tolerance, steps, *, loose_energy=0.0, first_shift=3e-4):
    """`jamlab/descend` with the usual numbers; natural units."""
    loose = [LOOSE_FORCE if not loose_energy else 1e9, loose_energy]
    return session.descend([tolerance, steps, *loose, *astuple(FAR), first_shift, NEWTON.definite])


@pytest.mark.parametrize("contact", ["outline", "segment/smooth"])
def test_the_first_step_is_that_of_the_shifted_hessian_of_numpy(dp_dense, contact):
    """No longer than the reach; away from a minimum, where forces stretch and turn edges."""
    packing = at_phi(dp_dense, dp_dense.phi + 0.01).with_state(params={**dp_dense.params, "contact": contact})
    with Session(packing) as session:
        force = session.evaluate().forces.ravel()
        found = descent(session, 1e-12, 1, first_shift=30.0)
        moved = (session.positions() - packing.positions).ravel()
    assert (found.steps, found.factors, found.refused) == (1, 1, 0)
    shift = max(30.0, FAR.shift * np.hypot(*force.reshape(-1, 2).T).max())
    wanted = np.linalg.solve(jamlab.hessian(packing).toarray() + shift * np.eye(len(force)), force)
    assert moved == pytest.approx(wanted * (moved @ wanted) / (wanted @ wanted), abs=1e-9 * np.abs(wanted).max())
    assert 0 < np.abs(moved).max() <= FAR.reach * (1 + 1e-12)


def test_the_second_step_is_that_of_the_first_factors_and_one_pair(dp_dense):
    """By numpy in double precision; factors in single precision give six digits of it."""
    start = at_phi(dp_dense, dp_dense.phi + 0.01)
    places, forces = [start.positions.ravel()], []
    with Session(start) as session:
        forces.append(session.evaluate().forces.ravel())
        for steps in (1, 2):
            session.load(start)
            assert descent(session, 1e-12, steps, first_shift=30.0).factors == 1
            places.append(session.positions().ravel())
            forces.append(session.evaluate().forces.ravel())
    matrix = jamlab.hessian(start).toarray() + 30.0 * np.eye(len(forces[0]))
    change, bend = places[1] - places[0], forces[0] - forces[1]
    along = change @ forces[1] / (change @ bend)
    wanted = np.linalg.solve(matrix, forces[1] - along * bend)
    wanted += (along - bend @ wanted / (change @ bend)) * change
    moved = places[2] - places[1]
    assert moved == pytest.approx(wanted * (moved @ wanted) / (wanted @ wanted), abs=1e-6 * np.abs(wanted).max())


def test_a_descent_near_a_minimum_needs_one_factorisation(dp_dense):
    """In steps to the tolerance, at an energy no higher than that of the minimum; nothing moves where it is enough."""
    kick = 1e-7 * np.random.default_rng(1).normal(size=dp_dense.positions.shape)
    with Session(dp_dense) as session:
        least = session.evaluate().energy
        session.set_positions(dp_dense.positions + kick)
        loose = descent(session, 1e-10, 100, loose_energy=1e9)
        assert (loose.steps, loose.factors, loose.forces) == (0, 0, 1)
        assert session.positions() == pytest.approx(dp_dense.positions + kick, abs=1e-14)
        found = descent(session, 1e-10, 100)
        state = session.evaluate()
    assert found.factors - found.refused == 1 and found.largest_force <= 1e-10 and 0 < found.steps < 20
    assert state.max_force <= 1.01e-10 and state.energy == pytest.approx(least, rel=1e-13)


def test_outlines_that_cross_end_a_descent():
    """A vertex on the edge of another droplet has no direction to go."""
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    law = {"gamma": 0.01, "eta": 0.0, "ka": 10.0, "eps": 1.0, "delta": 0.1, "contact": "outline", "a0": [1.0, 1.0]}
    x = np.concatenate([square, square + np.array([1.0, 0.3])])
    packing = jamlab.Packing("dp", np.diag([5.0, 5.0]), x, law, offsets=[0, 4, 8])
    with Session(packing) as session:
        assert descent(session, 1e-10, 5).crossed


@pytest.mark.parametrize("change", [0.01, -0.005])
def test_droplets_come_down_to_the_tolerance_by_descent_alone(dp_dense, change, monkeypatch):
    """From an affine step, without a single Newton step; the force on the same positions in numpy agrees."""
    for module in (relaxation, descent_of_droplets):
        monkeypatch.setattr(module, "descend_by_newton", idle)
    with jamlab.Session(at_phi(dp_dense, dp_dense.phi + change)) as session:
        assert relax_session(session).converged
        assert np.hypot(*jamlab.evaluate(session.packing()).forces.T).max() <= usual_force_tolerance("dp")


def test_a_loose_packing_is_left_early_and_a_jammed_one_is_not(dp_onset):
    """Below onset the effort ends when contacts are gone; above it the same call goes down to the tolerance."""
    with jamlab.Session(at_phi(dp_onset, dp_onset.phi - 1e-3)) as session:
        state = settle(session, 1e-10, loose=1e-13)
        assert state.contact_energy < 1e-13 * session.size and state.max_force > 1e-10
        session.load(at_phi(dp_onset, dp_onset.phi + 5e-3))
        state = settle(session, 1e-10, loose=1e-13)
        assert state.contact_energy > 1e-10 * session.size and state.max_force <= 1e-10


def test_folded_polygons_are_undone(dp_dense):
    with jamlab.Session(dp_dense) as session:
        before = session.positions()
        folded = before.copy()
        folded[[0, 6]] = folded[[6, 0]]
        session.set_positions(folded)
        assert session.self_crossings().tolist() == [0] and steps.entangled(session)
        undo_if_folded(session, before)
        assert session.positions() == pytest.approx(before, abs=1e-13) and not steps.entangled(session)
        moved = before + 1e-3
        session.set_positions(moved)
        undo_if_folded(session, before)
        assert session.positions() == pytest.approx(moved, abs=1e-13)


LOOSE, TIGHT = 1e-9, 1e-13


@pytest.fixture(scope="module")
def onset():
    return {tolerance: jamlab.jam(n=16, seed=1, force_tolerance=tolerance) for tolerance in (LOOSE, TIGHT)}


def _made(onset, kind, tolerance):
    if kind == "jam":
        return onset[tolerance]
    if kind == "compress":
        return next(jamlab.compress(onset[tolerance], to=0.9, step=0.1, force_tolerance=tolerance))
    if kind == "stabilized":
        return jamlab.pack(n=16, pressure=1e-2, seed=1, ensemble="shear-stabilized", force_tolerance=tolerance)
    return jamlab.pack(n=16, pressure=1e-2, seed=1, force_tolerance=tolerance)


@pytest.mark.parametrize("kind", ["jam", "compress", "pack", "stabilized"])
def test_the_tolerance_asked_for_is_met_and_recorded(onset, kind):
    for tolerance in (LOOSE, TIGHT):
        p = _made(onset, kind, tolerance)
        assert p.converged and p.force_tolerance == tolerance
        assert p.max_force <= tolerance
        assert jamlab.evaluate(p).max_force == pytest.approx(p.max_force, abs=1e-14)


def test_what_moves_particles_or_the_box_clears_the_mark(onset):
    p = onset[LOOSE]
    moved = {"positions": p.positions + 1e-9, "params": {"eps": 2.0}, "diameters": 1.1 * p.diameters}
    for q in (at_phi(p, 0.9), sheared(p, 1e-3), *(p.with_state(**{name: value}) for name, value in moved.items())):
        assert not q.converged and q.max_force is None
        assert "converged" not in q.provenance and "max_force" not in q.provenance
        assert q.provenance["seed"] == 1 and q.ensemble == p.ensemble
    assert p.with_state(phi_J=0.8).converged and p.with_state(provenance={"note": "kept"}).max_force == p.max_force


def test_every_way_down_ends_in_the_same_minimum(sp_jammed, dp_dense, monkeypatch):
    """Disks by L-BFGS where other steps do not get far; droplets by Newton steps after a single one of L-BFGS."""
    push = 1e-4 * np.random.default_rng(1).normal(size=sp_jammed.positions.shape)
    start = sp_jammed.with_state(positions=sp_jammed.positions + push)
    with Session(start) as session:
        for along_valley in (False, True):
            if along_valley:
                monkeypatch.setattr(steps, "QUENCH", steps.Quench(cg_steps=1))
                for module in (relaxation, steps):
                    monkeypatch.setattr(module, "descend_by_newton", idle)
            session.load(start)
            found = relax_session(session)
            assert found.converged and found.evaluation.energy == pytest.approx(
                jamlab.evaluate(sp_jammed).energy, rel=1e-9
            )
    monkeypatch.undo()
    monkeypatch.setattr(descent_of_droplets, "DROPLET_STEPS", descent_of_droplets.DropletSteps(settle=1))
    with Session(at_phi(dp_dense, dp_dense.phi + 1e-4)) as session:
        assert settle(session, 1e-10).max_force <= 1e-10


@pytest.mark.parametrize(("many", "method"), [(33, "cg"), (32, "fire")])
def test_onsets_by_either_minimizer_are_isostatic_and_say_which_it_was(many, method, monkeypatch):
    monkeypatch.setattr(steps, "QUENCH", steps.Quench(many_disks=many))
    onset = jamlab.jam(n=32, seed=3)
    assert onset.converged and jamlab.contacts(onset).n_contacts == jamlab.contacts(onset).isostatic
    (state,) = jamlab.compress(onset, onset.phi + 1e-3, by="phi")
    assert onset.provenance["minimizer"] == state.provenance["minimizer"] == method


def test_a_state_that_takes_many_factorisations_says_how_many_and_why_in_the_log(dp_dense, caplog, monkeypatch):
    """All of its descents and Newton steps, compiled or not; each factor refused raises the shift once."""
    counts, descend, factorise = [], Session.descend, newton.factorise

    def counted(session, numbers):
        counts.append(int(descend(session, numbers).factors))
        return session.last_descent

    def tried(matrix, shift, solver):
        used = factorise(matrix, shift, solver)
        counts.append(1 + round(np.log(used / shift) / np.log(NEWTON.definite)))
        return used

    monkeypatch.setattr(Session, "descend", counted)
    for module in (newton, newton_with_box):
        monkeypatch.setattr(module, "factorise", tried)
    caplog.set_level("DEBUG", logger="jamlab")
    jamlab.relax(dp_dense.with_state(positions=dp_dense.positions + 1e-9 * np.sin(dp_dense.positions)))
    assert 0 < sum(counts) <= SLIDES.few_factors and not caplog.records
    sheared = dp_dense.with_state(ensemble="shear-stabilized")
    for relaxed in (lambda: list(jamlab.compress(sheared, sheared.phi + 0.01, 0.01, by="phi")), lambda: jamlab.jam(8)):
        counts.clear()
        caplog.clear()
        relaxed()
        ((total, reasons, _),) = (record.args for record in caplog.records)
        assert total == sum(counts) > SLIDES.few_factors and reasons
