"""Down to a lower pressure: the crystal's exact box, what is kept, any units, and what is refused."""

import re
from dataclasses import replace

import numpy as np
import pytest

import jamlab
from jamlab.arguments.table import argument
from jamlab.errors import ConvergenceError, InputError
from jamlab.packing.packing import Packing
from jamlab.protocols import box_relaxation, decompression, target_pressure
from jamlab.protocols.decompression import decompress


def crystal(spacing, side=6):
    """Equal disks of diameter 1, k = 1, on a hexagonal lattice."""
    i, j = np.divmod(np.arange(side * side), side)
    box = side * spacing * np.array([[1.0, 0.5], [0.0, np.sqrt(0.75)]]).T
    positions = np.column_stack([j, i]) / side @ box
    return Packing("sp", box, positions, {"k": 1.0}, diameters=np.ones(side * side), units="k")


@pytest.fixture
def idle(monkeypatch):
    """A minimisation over disks and box that ends before forces are balanced."""
    monkeypatch.setattr(box_relaxation, "FREE_BOX", box_relaxation.FreeBox(rounds=1))
    monkeypatch.setattr(box_relaxation, "descend_with_box", lambda *_: None)


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
    again = decompress(found, 1e-6).provenance
    assert again["from_pressure"] == pytest.approx(1e-5) and again["pressure"] == pytest.approx(1e-6, rel=1e-6)
    # by a factor of at most five at a time, as `fall` says
    assert len(steps) == 5 and steps[-1] == 1.0 and steps == sorted(steps)
    shear = [state.stress[0, 1], state.stress[0, 0] - state.stress[1, 1]]
    if ensemble == "shear-stabilized":
        assert np.abs(shear).max() < 1e-11
        assert jamlab.shear_modulus(found, direction=np.linspace(0, 90, 7)).min() > 0
    else:
        assert found.box[1, 0] == 0 and found.box[0, 0] == found.box[1, 1] and np.abs(shear).max() > 1e-8


def test_only_the_last_step_down_is_minimised_in_full(monkeypatch):
    """On the way a part in ten thousand of the pressure will do."""
    noises, relax = [], decompression.relax_disks_and_box

    def noted(session, strains, noise, **how):
        noises.append(noise / strains.pressure)
        return relax(session, strains, noise, **how)

    monkeypatch.setattr(decompression, "relax_disks_and_box", noted)
    decompress(crystal(0.95), 1e-3, force_tolerance=1e-12)
    assert len(noises) > 2 and set(noises[:-1]) == {1e-4} and noises[-1] == pytest.approx(1e-9)


def test_what_a_compression_says_of_itself_is_gone():
    """Its target, whether it was met, and the onset that it began at."""
    *_, start = jamlab.compress(jamlab.jam(n=16, seed=1), to=0.9, step=0.05)
    found = decompress(start.with_state(on_target=False), 1e-4)
    assert found.on_target and found.phi_J is None and found.units == "eps"
    assert not {"by", "target", "search", "start", "step", "minimizer"} & set(found.provenance)


def test_units_of_limits_and_messages(sp_jammed, request):
    """Of a packing with stiffness 2^20 and lengths 2^-10: pressures far beyond 0.3, forces in its own units."""
    length, k = 2.0**-10, 2.0**20
    places = {"box": length * sp_jammed.box, "positions": length * sp_jammed.positions}
    start = sp_jammed.with_state(**places, diameters=length * sp_jammed.diameters, params={"k": k})
    assert decompress(start, 1e-4 * k).converged
    with pytest.raises(InputError, match=r"0\.0104858"):  # 1e-8 in its own units
        decompress(start, 1e-3)
    kicked = start.with_state(positions=start.positions + 1e-3 * length * np.random.default_rng(1).random((32, 2)))
    with pytest.raises(InputError):
        decompress(kicked, 1e-4 * k)
    request.getfixturevalue("idle")
    with pytest.raises(ConvergenceError):
        decompress(start, 1e-4 * k)


@pytest.mark.parametrize("ensemble, exponent", [("shear-stabilized", 2.0), ("fixed-box", 2.5)])
def test_a_pressure_that_random_disks_do_not_meet_is_reached_from_above(ensemble, exponent):
    """Near onset, where three of eight random starts end elsewhere; provenance says where the packing came from."""
    found = jamlab.pack(64, 1e-8, 1, ensemble=ensemble, law={"exponent": exponent})
    state, c = jamlab.evaluate(found), jamlab.contacts(found)
    assert found.converged and state.pressure == pytest.approx(1e-8, rel=1e-6)
    assert 0 <= c.n_contacts - c.isostatic <= 3 and found.ensemble == ensemble
    said = found.provenance
    assert said["seed"] == 1
    assert (said["protocol"] == "decompress") == ("from_pressure" in said)


def test_a_pressure_that_nothing_meets_is_refused(idle, monkeypatch):
    monkeypatch.setattr(target_pressure, "_ABOVE", ())
    with pytest.raises(ConvergenceError, match="1e-08"):
        jamlab.pack(64, 1e-8, 1)


def test_the_table_says_which_pressures_springs_may_have():
    low, high = re.search(r"springs are made at (\S+) to (\S+) in units of k", argument("pressure").text).groups()
    for beyond, limit in ((0.99 * float(low), rf"pressure of {float(low):g} or more"), (1.01 * float(high), high)):
        with pytest.raises(InputError, match=re.escape(limit)):
            jamlab.pack(16, beyond)
    recipe = jamlab.Recipe(protocol="pressure", n=16, pressure=float(low))
    for pressure in map(float, (low, high)):
        target_pressure.check_pressure(replace(recipe, pressure=pressure))
