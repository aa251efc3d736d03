"""What a state of a sweep costs beside its minimisation: in which order what is asked, and how often."""

from collections import Counter
from dataclasses import replace
from types import FunctionType

import numpy as np
import pytest
import shapely

import jamlab
from jamlab.engine.session import Session
from jamlab.mechanics import stiffness
from jamlab.packing.deformation import at_phi, at_positions
from jamlab.packing.packing import Packing
from jamlab.protocols import compression
from jamlab.protocols.relaxation import relax_session


@pytest.fixture(scope="module")
def onset():
    """16 droplets that just jam."""
    return jamlab.jam(16, "dp", 3)


def test_rattlers_are_asked_before_smaller_steps(onset, monkeypatch):
    """What rattlers stop costs a few slides, 2, 4, 8 and 16 steps cost ten times as much and end in the same state."""
    stopped = {"converged": True, "off_saddles": True, "on_rattlers": True}
    monkeypatch.setattr(compression, "leave_saddles", lambda session, found, again: replace(found, converged=False))
    monkeypatch.setattr(compression, "stopped_beside", lambda session, packing, found, again: replace(found, **stopped))
    monkeypatch.setattr(compression._Sweep, "_reach_by_steps", lambda sweep, phi: pytest.fail("went by steps"))
    (state,) = jamlab.compress(onset, to=jamlab.packing_fraction(onset) + 0.004, step=0.004)
    assert state.converged and state.on_rattlers


def test_a_descent_leaves_energy_and_stress_of_its_end(onset):
    """Those of a full setup of LAMMPS, which is not run again; moved vertices need one."""
    packing = at_phi(onset, 1.02 * onset.phi)
    with Session(packing) as session:
        ran = []
        session._run = lambda line, run=session._run: (ran.append(line.split()[0]), run(line))
        found = relax_session(session, 1e-10).evaluation
        reached = session.packing()
        assert ran == ["run", "jamlab/descend"]
        session.set_positions(reached.positions + 1e-3 * np.sin(reached.positions))
        assert session.evaluate().max_force > 1e-4
    by_setup = jamlab.evaluate(reached)
    assert found.pressure > 1e-3 and found.max_force < 1e-10
    assert found.stress == pytest.approx(by_setup.stress, abs=1e-12)
    assert found.energy == pytest.approx(by_setup.energy, rel=1e-12)


def test_a_dear_state_says_in_the_log_what_it_took(onset, monkeypatch, caplog):
    """Here the second of five, which goes by 2 steps where one led to no minimum, and slides."""
    settle, states = compression._Sweep._settle, []

    def dear(sweep, found):
        states.append(found)
        if len(states) != 2:
            return settle(sweep, found)
        for _ in range(8000):  # evaluations that count for it
            sweep.session.forces_at(sweep.session.positions())
        sweep.session.detours["slides along modes that give way"] += 3
        return sweep._reach_by_steps(sweep.session.packing().phi)

    monkeypatch.setattr(compression._Sweep, "_settle", dear)
    with caplog.at_level("INFO", "jamlab"):
        found = list(jamlab.compress(onset, to=jamlab.packing_fraction(onset) + 0.01, step=0.002))
    said = "3 slides along modes that give way, 1 way by 2 steps"
    (line,) = [each.getMessage() for each in caplog.records if "are usual" in each.getMessage()]
    assert line.endswith(said) and f"{jamlab.packing_fraction(found[1]):.6g}" in line
    assert [said in str(p.provenance.get("detours")) for p in found] == [False, True, False, False, False]
    assert line.startswith(f"{found[1].provenance['minimizer_steps']} steps of minimizers, where ")


def counted(monkeypatch, owner, name, counts):
    """Count the calls of a function."""
    function = getattr(owner, name)

    def call(*args, **kwargs):
        counts[name] += 1
        return function(*args, **kwargs)

    monkeypatch.setattr(owner, name, call)


def test_a_state_asks_neither_shapely_nor_numpy_for_a_hessian_and_is_copied_with_checks_once(onset, monkeypatch):
    counts = Counter()
    of_shapely = [name for name, each in vars(shapely).items() if isinstance(each, FunctionType)]
    for name in of_shapely:
        counted(monkeypatch, shapely, name, counts)
    for name in ("assemble", "stiffness", "hessian"):
        counted(monkeypatch, stiffness, name, counts)
    counted(monkeypatch, Packing, "__post_init__", counts)
    dense = jamlab.packing_fraction(onset) + 0.05
    for state in jamlab.compress(onset, to=dense + 0.02, step=0.004):
        if jamlab.packing_fraction(state) > dense:
            assert counts == {"__post_init__": 1}
        counts.clear()
    assert len(of_shapely) > 50 and jamlab.packing_fraction(state) > dense
    with pytest.raises(jamlab.SelfCrossingError):  # and the counts do count
        at_positions(onset, np.where(np.arange(onset.offsets[-1]) == 2, -1.0, 1.0)[:, None] * onset.positions)
    assert counts["is_valid"]
    jamlab.hessian(onset)
    onset.with_state(converged=False)
    assert counts["assemble"] == counts["__post_init__"] == 1


@pytest.mark.parametrize("name", ["droplets", "disks", "between walls", "one bin"])
def test_particles_in_order_give_the_bits_of_particles_built_anew(onset, name):
    """After LAMMPS has sorted them by other positions, in another box; one tiny box is never sorted."""
    makes = {"droplets": lambda: onset, "disks": lambda: jamlab.pack(32, 1e-2, seed=1)}
    makes |= {"between walls": lambda: jamlab.with_walls(jamlab.pack(64, 1e-2, seed=1))}
    packing = makes.get(name, lambda: jamlab.pack(4, 1e-2, seed=1))()

    def reached(*ways):
        """Positions after descents from packing fractions, each loaded in a way."""
        with Session(packing) as session:
            for phi, how in ways:
                session.load(at_phi(packing, phi * packing.phi), **how)
                session.last_descent = None
                relax_session(session, 1e-9)
            return session.packing().positions.tobytes()

    before = [(1.03, {}), (1.01, {})]
    anew = reached(*before, (1.001, {"anew": True}))
    assert reached((1.001, {"alike": True})) == reached(*before, (1.001, {"alike": True})) == anew
    assert name != "droplets" or reached(*before, (1.001, {})) != anew
