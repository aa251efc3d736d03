"""Numbers of the solvers can be handed in, and reach the solver that they belong to."""

from dataclasses import fields, replace

import numpy as np
import pytest

import jamlab
from jamlab.engine.session import Session
from jamlab.protocols.relaxation import relax

USUAL = jamlab.SolverSettings()
MADE = {
    "disks": lambda how: jamlab.jam(n=16, seed=1, settings=how),
    "pressed": lambda how: jamlab.pack(n=16, pressure=1e-2, seed=1, settings=how),
    "sheared": lambda how: jamlab.jam("dp", n=8, seed=1, ensemble="shear-stabilized", settings=how),
}


def changed(solver, **numbers):
    return replace(USUAL, **{solver: replace(getattr(USUAL, solver), **numbers)})


@pytest.mark.parametrize(
    ("made", "solver", "numbers"),
    [
        ("disks", "onset", {"decompressions": 0}),
        ("pressed", "pressure", {"ladder": ((3e-2, 0.0),)}),
        ("pressed", "box_relaxation", {"rounds": 0}),
        ("pressed", "border", {"last_shift": 0.0}),
    ],
)
def test_numbers_that_no_solver_can_work_with_end_the_work(made, solver, numbers):
    assert MADE[made](USUAL).converged
    with pytest.raises(jamlab.ConvergenceError):
        MADE[made](changed(solver, **numbers))


def test_a_sweep_without_secants_misses_its_packing_fraction():
    onset = jamlab.jam(n=16, seed=1)
    (state,) = jamlab.compress(onset, 0.87, 0.1, settings=changed("sweep", secant_steps=1))
    assert not state.on_target
    (state,) = jamlab.compress(onset, 0.87, 0.1)
    assert state.on_target


def test_a_box_that_may_not_shear_keeps_its_stress():
    with pytest.raises(jamlab.ConvergenceError):
        MADE["sheared"](changed("box_shear", steps=0))


def test_newton_steps_near_a_minimum_are_those_asked_for():
    packing = jamlab.jam(n=16, seed=1)
    moved = packing.with_state(positions=packing.positions + 1e-7 * np.random.default_rng(1).normal(size=(16, 2)))
    with Session(moved) as session:
        assert relax(session, near=True, settings=changed("newton", near_steps=0)).newton_steps == 0
    with Session(moved) as session:
        assert relax(session, near=True).newton_steps > 0


def test_droplets_relax_without_lbfgs_steps_as_well(dp_dense):
    push = 1e-4 * np.random.default_rng(1).normal(size=dp_dense.positions.shape)
    moved = dp_dense.with_state(positions=dp_dense.positions + push)
    with Session(moved) as session:
        assert relax(session).newton_steps == 0
    with Session(moved) as session:  # Newton and FIRE steps help out
        assert relax(session, settings=changed("lbfgs", steps=0)).newton_steps > 0


def test_defaults_are_those_of_the_argument():
    assert MADE["disks"](jamlab.SolverSettings()).phi == jamlab.jam(n=16, seed=1).phi
    assert {f.name for f in fields(USUAL)} >= {"newton", "lbfgs", "relaxation", "onset", "sweep", "pressure"}


@pytest.mark.parametrize(("many", "method"), [(33, "cg"), (32, "fire")])
def test_onsets_by_either_minimizer_are_isostatic_and_say_which_it_was(many, method):
    onset = jamlab.jam(n=32, seed=3, settings=changed("relaxation", many_disks=many))
    assert onset.converged and jamlab.contacts(onset).count == jamlab.contacts(onset).isostatic
    (state,) = jamlab.compress(onset, onset.phi + 1e-3, by="phi", settings=changed("relaxation", many_disks=many))
    assert onset.provenance["minimizer"] == state.provenance["minimizer"] == method
