"""The measuring of large packings: repeated packings, fits, and that a part is measured at all."""

import numpy as np
import pytest

import jamlab
from jamlab.studies.cost.size_scaling import PARTS, Cost, bytes_at, cost, fit_time, repeated


@pytest.mark.parametrize("make", ["random_disks", "random_polygons"])
def test_a_repeated_packing_has_the_energy_and_forces_of_its_copies(request, make):
    p = request.getfixturevalue(make)(0.3)
    one, nine = jamlab.evaluate(p), jamlab.evaluate(repeated(p, 3))
    assert nine.energy == pytest.approx(9 * one.energy, rel=1e-12)
    assert nine.max_force == pytest.approx(one.max_force, rel=1e-9)
    assert np.allclose(nine.stress, one.stress, rtol=1e-9, atol=1e-12 * np.abs(one.stress).max())
    assert np.std(repeated(p, 3, 1e-3).positions - repeated(p, 3).positions) == pytest.approx(1e-3, rel=0.3)


def test_a_power_law_is_found_again():
    costs = [Cost(n, 2e-6 * n**1.5, 1000 + 7 * n) for n in (64, 256, 1024)]
    law = fit_time(costs)
    assert law.exponent == pytest.approx(1.5) and law(10**6) == pytest.approx(2e3)
    assert bytes_at(costs, 10**6) == pytest.approx(7_001_000)


@pytest.mark.slow
def test_a_part_is_measured_in_a_process_of_its_own():
    found = cost("droplets: 10 forces", 32)
    assert found.n == 32 and 0 < found.seconds < 1 and 2e7 < found.bytes < 2e9
    assert {part.partition(":")[0] for part in PARTS} == {"disks", "droplets"}
