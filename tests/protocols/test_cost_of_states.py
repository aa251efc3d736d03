"""What a state of a sweep costs beside its minimisation: in which order what is asked, and how often."""

from dataclasses import replace

import pytest

import jamlab
from jamlab.protocols import compression


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
