"""The place in a sweep where z reaches 6, bisected, alone and in a campaign."""

import numpy as np
import pytest

import jamlab
from jamlab.campaign.file import CampaignTable
from jamlab.campaign.states import make_states
from jamlab.campaign.tasks import batches
from jamlab.errors import InputError
from jamlab.protocols.confluence import bisect_confluence

SWEEP = {"name": "s", "model": "sp", "n": 16, "seeds": [3], "compress": {"to": 1.24, "by": "phi", "step": 0.05}}


def task(**compress):
    table = CampaignTable.model_validate({"name": "c", "sweep": [SWEEP | {"compress": SWEEP["compress"] | compress}]})
    (batch,) = batches(table)
    (found,) = batch.tasks()
    return found


@pytest.fixture(scope="module")
def states():
    """States of a sweep with the place bisected where z reaches 6, and the same without."""
    return [make_states(task(**more).parameters).packings for more in ({"confluence": 1e-3}, {})]


def test_the_last_contact_is_found_to_the_error_asked_for(states):
    found, plain = states
    phi, z = np.array([(p.phi, jamlab.contacts(p).z) for p in found]).T
    assert (np.diff(phi) > 0).all() and all(p.converged and p.on_target for p in found)
    full = int(np.argmax(z >= 6))
    assert 0 < phi[full] - phi[full - 1] <= 1e-3
    # six halvings of 0.05; the states of the plain sweep are among them
    assert len(found) == len(plain) + 6
    assert {p.phi for p in plain} <= set(phi)


def test_states_that_do_not_enclose_confluence_are_refused(states):
    plain = states[1]
    for pair in [(plain[0], plain[1]), (plain[-1], plain[0]), (plain[-1], plain[-1])]:
        with pytest.raises(InputError):
            list(bisect_confluence(*pair, 1e-3, by="phi"))
