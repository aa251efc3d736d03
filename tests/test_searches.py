"""How often one measurement looks for neighbours and builds the energy terms: what is found once is handed on."""

import sys
from collections import Counter

import numpy as np
import pytest

import jamlab
from jamlab.geometry.vertex_contacts import vertex_contacts
from jamlab.mechanics.energy_terms import energy_terms
from jamlab.packing.neighbors import periodic_copies, periodic_neighbors, periodic_pairs

SEARCHES = (periodic_pairs, periodic_neighbors, periodic_copies, vertex_contacts)


@pytest.fixture
def calls(monkeypatch, sp_jammed, dp_onset, dp_dense):
    """Counts of the neighbour searches and of the builds of energy terms, from when all packings are made."""
    for name in jamlab.__all__:  # a module loaded later would keep the counting functions for good
        getattr(jamlab, name)
    counts = Counter()

    def counting(function, kind):
        def wrapped(*args, **kwargs):
            counts[kind] += 1
            return function(*args, **kwargs)

        return wrapped

    kinds = {function: "search" for function in SEARCHES} | {energy_terms: "build"}
    for module in [m for name, m in sys.modules.items() if name.startswith("jamlab.")]:
        for function, kind in kinds.items():
            if getattr(module, function.__name__, None) is function:
                monkeypatch.setattr(module, function.__name__, counting(function, kind))
    return counts


@pytest.fixture(params=["sp_jammed", "dp_onset", "dp_dense"])
def packing(request):
    return request.getfixturevalue(request.param)


def searches(packing):
    """One; of droplets that could lie in another or cross far from a vertex, a second that refuses those."""
    if packing.model == "sp":
        return 1
    area, delta = packing.polygon_areas, packing.params["delta"]
    nested = area.max() > (np.sqrt(area.min()) + np.sqrt(np.pi) * delta) ** 2
    return 1 + int(nested or np.hypot(*packing.edges.T).max() > 2 * delta)


def test_measure(calls, packing):
    """Contacts; edges, corners and rays for voids. Terms with and without rattlers. 13 and 6 in release 0.1.0."""
    jamlab.measure(packing)
    assert 1 <= calls["search"] <= 4 and 1 <= calls["build"] <= 2


@pytest.mark.parametrize("law", [jamlab.ContactDamping(), jamlab.StokesDrag()], ids=["contact", "stokes"])
@pytest.mark.parametrize("method", ["dense", "direct", "reduced"])
def test_complex_modulus(calls, packing, law, method):
    """The fluid deforms droplets that rattle, each by itself."""
    alone = jamlab.contacts(packing).rattlers.sum() if packing.model == "dp" and not law.at_contacts else 0
    calls.clear()
    jamlab.complex_modulus(packing, np.array([1e-2, 1.0]), law, method=method)
    assert calls["build"] == 1 + alone and calls["search"] == searches(packing)


@pytest.mark.parametrize("name", ["elastic_tensor", "hessian", "displacement_correlation", "dynamical_matrices"])
def test_linear_response(calls, packing, name):
    getattr(jamlab, name)(packing, *[1.0] * (name == "displacement_correlation"))
    assert calls["build"] == 1 and calls["search"] == searches(packing)


def test_slow_shear(calls, sp_jammed):
    jamlab.slow_shear(sp_jammed)
    assert calls["search"] == calls["build"] == 1
