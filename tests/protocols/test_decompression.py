"""Droplets down to a lower pressure: minima of the enthalpy, on one way down where nothing rearranges."""

import numpy as np
import pytest

import jamlab
from jamlab.errors import ConvergenceError, InputError
from jamlab.protocols import box_relaxation
from jamlab.protocols.decompression import decompress


@pytest.fixture(scope="module", params=["fixed-box", "shear-stabilized"])
def start(request):
    return jamlab.relax(jamlab.read("tests/states/stable_droplets.h5").with_state(ensemble=request.param))


@pytest.fixture(scope="module")
def high(start):
    return jamlab.evaluate(start).pressure


@pytest.fixture(scope="module")
def half(start, high):
    return decompress(start, 0.5 * high)


def test_the_pressure_is_met_at_a_minimum(start, high):
    found = decompress(start, 1e-4)
    state = jamlab.evaluate(found)
    assert state.pressure == pytest.approx(1e-4, rel=1e-6) and state.max_force <= 1e-10
    assert found.converged and found.ensemble == start.ensemble and found.phi_J is None
    assert all(np.array_equal(found.params[name], value) for name, value in start.params.items())
    said = found.provenance
    assert said["protocol"] == "decompress" and said["from_pressure"] == pytest.approx(high, rel=1e-9)
    assert said["pressure"] == pytest.approx(1e-4, rel=1e-6)
    assert jamlab.lowest_modes(found, 3).eigenvalues.min() > -1e-9
    shear = np.hypot(state.stress[0, 1], 0.5 * (state.stress[0, 0] - state.stress[1, 1]))
    if start.ensemble == "fixed-box":
        assert np.allclose(found.box, start.box * np.sqrt(found.area / start.area), rtol=1e-12) and shear > 1e-2 * 1e-4
    else:
        assert shear < 1e-6 * 1e-4
        assert jamlab.shear_modulus(found, direction=np.linspace(0, np.pi, 7)).min() > 0


def test_energy_falls_by_the_work_of_the_pressure(start, high):
    """dU/dA = -p along the minima of the enthalpy, with shear or without."""
    above, below = (decompress(start, 0.5 * high * part) for part in (1.01, 0.99))
    energy = [jamlab.evaluate(state).energy for state in (above, below)]
    assert energy[1] < energy[0] and below.area > above.area
    assert (energy[0] - energy[1]) / (below.area - above.area) == pytest.approx(0.5 * high, rel=1e-4)


def test_one_way_leads_to_one_state(start, high, half):
    """Directly, over a pressure between, and back from a compression."""
    between = decompress(decompress(start, 0.8 * high), 0.5 * high)
    *_, dense = jamlab.compress(half, start.phi, 1.0, by="phi")
    back = decompress(dense, 0.5 * high)
    assert jamlab.evaluate(dense).pressure == pytest.approx(high, rel=1e-6)
    energy = jamlab.evaluate(half).energy
    for found in (between, back):
        assert found.phi == pytest.approx(half.phi, rel=1e-9)
        assert jamlab.evaluate(found).energy == pytest.approx(energy, rel=1e-9)


def test_what_droplets_cannot_come_down_to_is_refused(half):
    for pressure, words in ((1e-7, "1e-06 or more"), (-1e-3, "above 0"), (1.0, "at ")):
        with pytest.raises(InputError, match=words):
            decompress(half, pressure)
    assert decompress(half, 1e-3, force_tolerance=1e-9).force_tolerance == 1e-9
    with pytest.raises(InputError, match="ranks"):
        decompress(half, 1e-3, ranks=2)


def test_outlines_that_cross_on_the_way_are_tried_again_by_less(half, high, monkeypatch):
    """Outlines of the first states are said to cross: steps get shorter, and the end is the same."""
    crossed = [True, True]
    entangled = box_relaxation.entangled
    monkeypatch.setattr(box_relaxation, "entangled", lambda session: crossed.pop() if crossed else entangled(session))
    found = decompress(half, 0.4 * high)
    assert not crossed and jamlab.evaluate(found).pressure == pytest.approx(0.4 * high, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "pressure"), [(2, 1e-6), (5, 1e-4)])
def test_enthalpies_without_digits_do_not_stop_the_box(seed, pressure):
    """Steps that only lower the unbalanced stress end these two."""
    *_, dense = jamlab.compress(jamlab.jam(8, "dp", seed, ensemble="shear-stabilized"), 0.93, 0.02)
    found = decompress(dense, pressure)
    assert found.converged and jamlab.evaluate(found).pressure == pytest.approx(pressure, rel=1e-6)


def test_a_pressure_that_is_not_met_is_no_result(half, monkeypatch):
    monkeypatch.setattr(box_relaxation, "FREE_BOX", box_relaxation.FreeBox(areas=1, returns=0))
    with pytest.raises(ConvergenceError, match="pressure not reached"):
        decompress(half, 1e-3)
