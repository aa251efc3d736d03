"""The minimiser of shapes: descent, when it stops, and what it undoes."""

import numpy as np
import pytest

import jamlab
from jamlab.packing.deformation import at_phi
from jamlab.protocols.preconditioned_lbfgs import descend_by_lbfgs
from jamlab.protocols.relaxation import descend_by_fire, force_tolerance, relax, settle, undo_if_folded


def valley(x):
    """Energy and forces of 5 points in stiff and soft parabolas, minimum at (1, -1), 1e4 apart in stiffness."""
    k = np.array([1e4, 1.0])
    off = x - np.array([1.0, -1.0])
    return float(0.5 * np.sum(k * off**2)), -k * off


def test_descent_with_the_exact_inverse_takes_one_line():
    calls = []

    def counted(x):
        calls.append(1)
        return valley(x)

    inverse = np.tile([1e-4, 1.0], 5)
    start = np.array([1.0, -1.0]) + 0.04 * np.random.default_rng(1).uniform(-1, 1, (5, 2))
    found, met = descend_by_lbfgs(counted, start, lambda x, shift: lambda f: inverse * f, tolerance=1e-9, steps=10)
    assert met and len(calls) <= 3
    assert found == pytest.approx(np.tile([1.0, -1.0], (5, 1)), abs=1e-8)


def test_descent_without_preconditioner_learns_the_soft_direction():
    start = np.array([1.0, -1.0]) + 0.5 * np.random.default_rng(2).uniform(-1, 1, (5, 2))
    found, met = descend_by_lbfgs(valley, start, lambda x, shift: lambda f: f, tolerance=1e-9, steps=300)
    assert met and found == pytest.approx(np.tile([1.0, -1.0], (5, 1)), abs=1e-8)


def test_descent_stops_where_it_is_enough():
    start = np.full((5, 2), 3.0)
    seen = []

    def enough(largest):
        seen.append(largest)
        return len(seen) == 4

    found, met = descend_by_lbfgs(
        valley, start, lambda x, shift: lambda f: 1e-4 * f, tolerance=1e-9, steps=300, enough=enough
    )
    assert not met and len(seen) == 4
    assert np.hypot(*valley(found)[1].T).max() == pytest.approx(seen[-1])


@pytest.mark.parametrize("change", [0.01, -0.005])
def test_droplets_come_down_to_the_tolerance_by_descent_alone(dp_dense, change):
    """From an affine step, without a single Newton step; the force on the same positions in numpy agrees."""
    with jamlab.Session(at_phi(dp_dense, dp_dense.phi + change)) as session:
        found = relax(session)
        assert found.converged and found.newton_steps == 0
        assert np.hypot(*jamlab.evaluate(session.packing()).forces.T).max() <= force_tolerance("dp")


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
        assert session.self_crossings().tolist() == [0]
        undo_if_folded(session, before)
        assert session.positions() == pytest.approx(before, abs=1e-13)
        moved = before + 1e-3
        session.set_positions(moved)
        undo_if_folded(session, before)
        assert session.positions() == pytest.approx(moved, abs=1e-13)


def test_fire_that_throws_droplets_apart_is_taken_back(dp_onset, monkeypatch):
    """LAMMPS loses atoms that fly off; the packing before is built anew, and the rounds go on."""
    with jamlab.Session(dp_onset) as session:
        before = session.evaluate()

        def explode(*args, **options):
            session.set_positions(dp_onset.positions * 1e3)
            raise jamlab.EngineError("Lost atoms: original 174 current 173")

        monkeypatch.setattr(session, "minimize", explode)
        descend_by_fire(session, 1e-10)
        assert session.positions() == pytest.approx(dp_onset.positions, rel=0, abs=1e-14)  # less rounding of the images
        assert session.evaluate().energy == pytest.approx(before.energy, rel=1e-14)


@pytest.mark.slow
def test_a_seed_whose_droplets_flew_apart_finds_its_onset():
    assert jamlab.jam("dp", 64, 104).converged
