"""Down to a lower pressure: the crystal's exact box, what is kept, any units, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

import jamlab
from jamlab.errors import ConvergenceError, InputError
from jamlab.packing.deformation import at_phi
from jamlab.packing.packing import Packing
from jamlab.protocols.relaxation import quench
from jamlab.protocols.target_pressure import decompress


def crystal(spacing, side=6):
    """Equal disks of diameter 1, k = 1, on a hexagonal lattice."""
    i, j = np.divmod(np.arange(side * side), side)
    box = side * spacing * np.array([[1.0, 0.5], [0.0, np.sqrt(0.75)]]).T
    positions = np.column_stack([j, i]) / side @ box
    return Packing("sp", box, positions, {"k": 1.0}, diameters=np.ones(side * side), units="k")


@pytest.mark.parametrize("target", [1e-2, 1e-5])
def test_a_crystal_comes_down_to_its_exact_spacing(target):
    """Six contacts of force k (1 - r) give p = sqrt(3) k (1 - r)/r."""
    found = decompress(crystal(0.95), target)
    spacing = np.sqrt(found.area / (np.sqrt(0.75) * found.n))
    assert found.converged and spacing == pytest.approx(1 / (1 + target / np.sqrt(3)), rel=1e-9)


@pytest.mark.parametrize("ensemble", ["fixed-box", "shear-stabilized"])
def test_the_way_down_keeps_disks_and_ensemble_and_says_where_it_began(ensemble):
    start = jamlab.pack(32, 1e-2, 2, ensemble=ensemble)
    steps = []
    found = decompress(start, 1e-5, progress=lambda share, words: steps.append(share))
    state = jamlab.evaluate(found)
    assert found.converged and state.max_force <= 1e-12 and state.pressure == pytest.approx(1e-5, rel=1e-6)
    assert found.ensemble == ensemble and np.array_equal(found.diameters, start.diameters)
    said = found.provenance
    assert (said["protocol"], said["seed"]) == ("decompress", 2)
    assert said["pressure"] == pytest.approx(1e-5, rel=1e-6) and said["from_pressure"] == pytest.approx(1e-2)
    # by a factor of at most five at a time, as `fall` says
    assert len(steps) == 5 and steps[-1] == 1.0 and steps == sorted(steps)
    shear = [state.stress[0, 1], state.stress[0, 0] - state.stress[1, 1]]
    if ensemble == "shear-stabilized":
        assert np.abs(shear).max() < 1e-11
        assert jamlab.shear_modulus(found, angle=np.linspace(0, 90, 7)).min() > 0
    else:
        assert found.box[1, 0] == 0 and found.box[0, 0] == found.box[1, 1] and np.abs(shear).max() > 1e-8


def test_packings_in_other_units_come_down_alike():
    """Lengths and stiffnesses by powers of two change no digit; pressures are those of the packing."""
    start = jamlab.pack(32, 1e-2, 3)
    length, k = 2.0**-20, 2.0**11
    other = start.with_state(
        box=length * start.box,
        positions=length * start.positions,
        diameters=length * start.diameters,
        params={"k": k},
    )
    here, there = decompress(start, 1e-4), decompress(other, 1e-4 * k)
    assert np.array_equal(there.positions, length * here.positions)
    for name in ("pressure", "from_pressure"):
        assert there.provenance[name] == k * here.provenance[name]


@pytest.mark.parametrize(
    ("pressure", "message"),
    [
        (1e-2, r"pressure = 0.01: the packing is at a pressure of 0.001: give one jammed at a higher pressure"),
        (1e-9, r"pressure = 1e-09: a force tolerance of 1e-12 .* raise the pressure to 1e-08 or more"),
        (-1.0, r"pressure"),
        (np.nan, r"pressure"),
    ],
)
def test_pressures_that_are_not_below(sp_jammed, pressure, message):
    with pytest.raises(InputError, match=message):
        decompress(sp_jammed, pressure)


def test_packings_that_cannot_come_down(sp_jammed, dp_onset):
    with pytest.raises(InputError, match="the packing is not jammed"):
        decompress(at_phi(sp_jammed, 0.5), 1e-4)
    with pytest.raises(InputError, match="take droplets down by `compress`"):
        decompress(dp_onset, 1e-4)


def test_a_pressure_that_is_not_met_is_refused(sp_jammed):
    """Solvers without steps: the state is not returned, and the numbers are named."""
    default = jamlab.SolverSettings()
    numbers = replace(default.box_relaxation, rounds=1, near=0, noise=1e-2)
    settings = replace(default, box_relaxation=numbers, border=replace(default.border, steps=0))
    with pytest.raises(ConvergenceError, match=r"0.0001 not met with n = 32: .* 1e-12 is asked for; start from"):
        decompress(sp_jammed, 1e-4, settings=settings)


def test_forces_above_a_target_by_rounding_alone_are_relaxed_further(sp_jammed):
    """Large packings: the minimiser sums forces in another order than the evaluation, and stops a percent too early."""
    goal, asked = 2.0**-40, []

    class Descent:
        springs, state = True, replace(jamlab.evaluate(sp_jammed), max_force=1.0)

        def evaluate(self):
            return self.state

        def minimize(self, force, **_):
            asked.append(force)
            self.state = replace(self.state, max_force=1.002 * force)
            return self.state

    session = Descent()
    for _ in range(2):  # a round of a relaxation is a call
        state = quench(session, goal, floor=1.0)
    assert state.max_force <= goal and asked == [goal, goal / 2]
