"""Minimisation under mpiexec: the same minimum on any number of ranks, and what is refused."""

import sys

import numpy as np
import pytest

import jamlab
from jamlab.engine.mpi_ranks import minimize_on_ranks
from jamlab.protocols.relaxation import relax


@pytest.fixture(scope="module")
def minimum():
    """256 disks."""
    return jamlab.pack(256, 1e-2, seed=1)


@pytest.fixture(scope="module")
def start(minimum):
    """The same, every disk pushed by 1e-4: in the basin still."""
    push = 1e-4 * np.random.default_rng(0).normal(size=(256, 2))
    return minimum.with_state(positions=minimum.positions + push)


def relaxed(packing):
    """Positions at the bottom, seen from the centre of mass: the energy does not hold the packing as a whole."""
    with jamlab.Session(packing) as session:
        found = relax(session, near=True)
        assert found.converged
        x = session.packing().positions
    return x - x.mean(axis=0)


@pytest.mark.parametrize("style", ["cg", "fire"])
def test_two_ranks_find_the_minimum_of_one(minimum, start, style):
    """To the force asked for, in unwrapped positions in the order given; relaxed, within 1e-9 of each other."""
    held = ~jamlab.contacts(minimum).rattlers
    origin = minimum.positions[held] - minimum.positions[held].mean(axis=0)
    found = []
    for ranks in (1, 2):
        x = minimize_on_ranks(start, force=1e-9, style=style, steps=20_000, ranks=ranks)
        assert x.shape == (256, 2) and x.flags.c_contiguous
        state = start.with_state(positions=x)
        assert jamlab.evaluate(state).max_force < 2e-9 < 1e-6 < jamlab.evaluate(start).max_force
        assert np.abs(x - start.positions).max() < 5e-3  # neither wrapped nor renumbered
        x = relaxed(state)[held]
        found.append(x - x.mean(axis=0))
    assert np.abs(found[0] - found[1]).max() < 1e-9
    assert np.abs(found[0] - origin).max() < 1e-8


def test_force_law_of_the_packing_is_used(random_disks):
    """Stiffness by size of pairs, three sizes, a tilted box: minimum of LAMMPS in this process as well."""
    p = random_disks(0.3, n=24, phi=1.1)
    x = minimize_on_ranks(p, force=1e-11, style="cg", steps=50_000, ranks=2)
    e = jamlab.evaluate(p.with_state(positions=x))
    assert e.max_force < 2e-11 and 0 < e.energy < jamlab.evaluate(p).energy


@pytest.mark.parametrize("ranks", [0, -2, True, 1.5, "2", None])
def test_bad_numbers_of_ranks(minimum, ranks):
    """By every way in, before any process starts."""
    with pytest.raises(jamlab.InputError, match="ranks"):
        minimize_on_ranks(minimum, force=1e-9, style="cg", steps=10, ranks=ranks)
    with pytest.raises(jamlab.InputError, match="ranks"):
        jamlab.pack(8, 1e-2, ranks=ranks)


def test_polygons_are_refused(random_polygons):
    """One rank is faster there."""
    with pytest.raises(jamlab.InputError, match="ranks = 2"):
        minimize_on_ranks(random_polygons(), force=1e-9, style="cg", steps=10, ranks=2)


def test_missing_mpiexec_is_told(start, monkeypatch, tmp_path):
    """Programs are looked for beside the interpreter."""
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    with pytest.raises(jamlab.EngineError, match="ranks = 2"):
        minimize_on_ranks(start, force=1e-9, style="cg", steps=10, ranks=2)


def test_last_words_of_lammps_are_told(start):
    """A minimiser that LAMMPS does not have."""
    with pytest.raises(jamlab.EngineError, match="nonsense"):
        minimize_on_ranks(start, force=1e-9, style="nonsense", steps=10, ranks=2)
