"""What no view of a packing may change, for every public function that takes one: order, place, images, lattice,
sense, units and copies. `tests/support/invariant_cases.py` lists them."""

import numpy as np
import pytest
from invariant_cases import CASES, NOT_COMPARED, TOGETHER, deviation, packings, public_functions_of_packings

RUNS = [(name, model) for name, case in CASES.items() for model in case.models]


def test_no_public_function_of_a_packing_is_forgotten():
    assert CASES.keys().isdisjoint(NOT_COMPARED)
    assert public_functions_of_packings() == CASES.keys() | NOT_COMPARED.keys()


@pytest.mark.parametrize("name, model", RUNS)
def test_views(name, model):
    """All together, but for those in which a function sees another packing; the same again gives the same bits."""
    packing = packings()[model]
    before = packing.positions.copy()
    found = {together: deviation(name, model, views) for together, views in TOGETHER.items()}
    assert found.pop("same") == 0 and np.array_equal(packing.positions, before)
    assert max(found.values()) < CASES[name].tolerance, found
