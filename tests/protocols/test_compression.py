"""Sweeps: which packing fractions they visit, how they follow a basin, what is refused."""

from itertools import product

import numpy as np
import pytest

import jamlab
from jamlab.errors import ConvergenceError
from jamlab.protocols import descent, relaxation
from jamlab.protocols.compression import grid


@pytest.fixture(scope="module")
def start():
    """32 disks whose basin reaches far in both directions."""
    return jamlab.pack(32, 1e-3, seed=3)


def unlike(one, two):
    """Largest distance of a disk in two states, boxes brought to one size, common shift and rattlers left out."""
    held = ~jamlab.contacts(one).rattlers
    move = (two.positions @ np.linalg.inv(two.box) - one.positions @ np.linalg.inv(one.box))[held]
    return np.abs(move - move.mean(axis=0)).max()


def test_grid_ends_exactly():
    """No state beyond `to`, none twice; a whole number of steps but for rounding gives no sliver at the end."""
    for to, step, nearest in ((0.845, 0.02, None), (0.845, 0.02, 0.01), (0.835, 0.005, 0.005)):
        assert grid(0.84, to, step, nearest).tolist() == [to]
    points = grid(0.84, 0.90, 0.01)
    assert len(points) == 6 and points[-1] == 0.90
    assert np.diff(points) == pytest.approx(0.01, rel=1e-9)


@pytest.mark.parametrize("by", ["rho", "phi"])
def test_compression_of_disks_hits_its_targets(by):
    """Each state is a minimum; the last one lies at `to` within 1e-6, those before within 1 % of a step."""
    start = jamlab.jam(model="sp", n=32, seed=1)
    reached = jamlab.packing_fraction if by == "rho" else lambda p: p.phi
    states = list(jamlab.compress(start, to=0.95, step=0.04, by=by))
    assert len(states) == np.ceil((0.95 - reached(start)) / 0.04)
    wanted = [*(reached(start) + 0.04 * np.arange(1, len(states))), 0.95]
    assert [reached(p) for p in states] == pytest.approx(wanted, abs=4e-4)
    assert reached(states[-1]) == pytest.approx(0.95, abs=1e-6)
    pressure = [jamlab.evaluate(p).pressure for p in [start, *states]]
    assert np.all(np.diff(pressure) > 0)
    for p in states:
        assert p.converged is True and jamlab.evaluate(p).max_force <= 1e-12
        assert p.phi_J == start.phi_J and np.array_equal(p.diameters, start.diameters)


def test_states_near_onset_are_log_spaced():
    """U ~ (phi - phi_J)^2 and p ~ phi - phi_J hold over the decades that the grid visits."""
    onset = jamlab.jam(16, "sp", seed=3)
    states = list(jamlab.compress(onset, to=onset.phi_J + 1e-3, step=1e-3, by="phi", first_step=1e-5))
    wanted = [*(1e-5 * 10 ** (0.2 * np.arange(10))), 1e-3]
    above = np.array([p.phi - onset.phi_J for p in states])
    assert above == pytest.approx(wanted, rel=0.02)
    assert states[-1].phi == pytest.approx(onset.phi_J + 1e-3, abs=1e-6)
    e = [jamlab.evaluate(p) for p in states]
    assert np.polyfit(np.log(above[:6]), np.log([x.pressure for x in e[:6]]), 1)[0] == pytest.approx(1, abs=0.05)
    assert np.polyfit(np.log(above[:6]), np.log([x.energy for x in e[:6]]), 1)[0] == pytest.approx(2, abs=0.1)
    assert all(p.converged and p.on_target for p in states)
    assert [p.provenance["target"] for p in states] == pytest.approx(np.add(onset.phi_J, wanted), abs=1e-9)


@pytest.mark.parametrize("by", ["phi", "rho"])
def test_small_excursion_comes_back(start, by):
    """Energies on the way down are those on the way up."""
    at = start.phi if by == "phi" else jamlab.packing_fraction(start)
    up = list(jamlab.compress(start, at + 2e-3, 5e-4, by=by, pressure_tolerance=1e-2))
    *down, home = jamlab.compress(up[-1], at, 5e-4, by=by, pressure_tolerance=1e-2)
    assert len(up) == 4 and len(down) == 3
    for one, two in zip([start, *up[:-1]], [home, *down[::-1]], strict=True):
        shift = two.phi - one.phi
        assert abs(shift) < 1e-5  # targets are met to 1 % of a step, the last to 1e-6
        e, other = jamlab.evaluate(one), jamlab.evaluate(two)
        # dU = p A dln(phi): the energy at the phi of the other state
        moved = e.energy + 0.5 * (e.pressure + other.pressure) * one.area * shift / one.phi
        assert other.energy == pytest.approx(moved, rel=1e-6)
        assert unlike(one, two) < 1e-4


def test_decompression_loses_the_last_contact(start):
    """Followed down through onset: the pressure falls to nothing, and nothing is foretold there."""
    *_, last = jamlab.compress(start, start.phi - 0.01, 5e-3, by="phi", pressure_tolerance=1e-1)
    assert last.phi == pytest.approx(start.phi - 0.01, abs=1e-6)
    assert jamlab.evaluate(last).pressure < 1e-9
    assert jamlab.contacts(last).n_backbone == 0


def test_long_steps_of_thin_rims_are_halved_until_they_end_in_minima():
    """In one step of 0.08 outlines cross, and the packing fraction would go to 1.15."""
    onset = jamlab.jam(8, "dp", 1, law={"delta": 0.02}, start="from-disks")
    states = list(jamlab.compress(onset, to=0.98, step=0.08))
    assert all(p.converged and p.on_target for p in states)
    assert all(jamlab.evaluate(p).max_force <= 1.01e-10 for p in states) and states[-1].phi < 1.05


def test_a_sweep_does_not_go_on_from_what_is_no_minimum(start, monkeypatch):
    """The state is handed out with its mark, then an error names it; the last state of a sweep needs none."""
    monkeypatch.setattr(descent, "QUENCH", descent.Quench(cg_steps=1))
    for module, stopped in product((relaxation, descent), ("descend_by_newton", "descend_by_lbfgs")):
        monkeypatch.setattr(module, stopped, lambda session, *_: session.evaluate(), raising=False)
    sweep = jamlab.compress(start, start.phi + 0.02, 0.01, by="phi")
    flagged = next(sweep)
    assert flagged.converged is False
    with pytest.raises(ConvergenceError, match=f"{flagged.phi:.6g}"):
        next(sweep)
    (last,) = jamlab.compress(start, start.phi + 0.01, 0.01, by="phi")
    assert last.converged is False


@pytest.mark.parametrize("error", [None, pytest.param(3e-2, marks=pytest.mark.slow)])
def test_ensemble_is_kept(start, error):
    """Up and down; the box goes on shearing, or stays square."""
    stabilized = jamlab.pack(16, 1e-3, seed=1, ensemble="shear-stabilized")
    for p, name in ((start, "fixed-box"), (stabilized, "shear-stabilized")):
        for sign in (1, -1):
            for q in jamlab.compress(p, p.phi + sign * 1e-3, 5e-4, by="phi", pressure_tolerance=error):
                e = jamlab.evaluate(q)
                shear = np.hypot(0.5 * (e.stress[0, 0] - e.stress[1, 1]), e.stress[0, 1]) / e.pressure
                assert q.ensemble == name
                assert shear < 1e-8 if name == "shear-stabilized" else shear > 1e-3
                assert (q.box[1, 0] == 0) == (name == "fixed-box")
                assert sign * (e.pressure - 1e-3) > 0


@pytest.mark.parametrize(("seed", "to"), [(1, 0.88), (4, 0.9316)])
def test_droplets_end_in_minima(seed, to):
    """Two states that ended on saddles: forces below 1e-10, and a mode of stiffness -4e-4 and -3e-3."""
    *_, p = jamlab.compress(jamlab.jam(8, "dp", seed), to=to, step=0.02)
    assert p.converged and jamlab.shear_modulus(p, direction="simple") > 0
