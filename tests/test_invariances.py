"""What no view of a packing may change, for every public function that takes one: order, place, images, lattice,
sense, units and copies. `tests/support/invariant_cases.py` lists them."""

import numpy as np
import pytest
from invariant_cases import CASES, EXACT, NOT_COMPARED, deviation, packings, public_functions_of_packings, together

from jamlab.packing.kinds import MODELS

LONG = {("creep", "dp"), ("oscillate", "dp"), ("relax_stress", "dp")}  # `shear` of droplets is the short one
RUNS = [
    pytest.param(name, model, marks=[pytest.mark.slow] if (name, model) in LONG else [])
    for name, case in CASES.items()
    for model in case.models
]


def test_no_public_function_of_a_packing_is_forgotten():
    assert CASES.keys().isdisjoint(NOT_COMPARED)
    assert public_functions_of_packings() == CASES.keys() | NOT_COMPARED.keys()


def test_every_parameter_of_every_law_is_compared():
    """In some packing at a value of its own, not the default or 0."""
    seen = set()
    for p in packings().values():
        own = [name for name, each in p.parameters.items() if name in p.params and p.params[name] is not each.default]
        seen |= {(p.model, p.units, name) for name in own if np.any(p.params[name])}
    laws = [(kind, units) for kind in map(MODELS.get, MODELS.names()) for units in kind.unit_names]
    assert seen == {(kind.name, u, name) for kind, u in laws for name in kind.parameters(u, {})}


@pytest.mark.parametrize("name, model", RUNS)
def test_views(name, model):
    """All together, but for those in which a function sees another packing; the same again gives the same bits."""
    packing = packings()[model]
    before = packing.positions.copy()
    found = {several: deviation(name, model, views) for several, views in together(model).items()}
    assert found.pop("same") == 0 and np.array_equal(packing.positions, before)
    assert found["metres"] < EXACT  # minima and flows too: no number of a solver stands in other than natural units
    assert max(found.values()) < CASES[name].tolerance, found
