"""Contacts of droplets that move while neighbor lists last: vertices meet edges that were far away."""

from dataclasses import replace

import numpy as np
import outlines
import pytest


@pytest.mark.parametrize("form", outlines.FORMS)
@pytest.mark.parametrize("steps", [1, 150])
def test_droplets_that_come_and_go(lmp, tmp_path, form, steps):
    """Forces by numpy, at each place of one that moves by less than half the skin, after few or many evaluations."""
    path = -0.39 * np.array([0.0, 0.3, 0.6, 0.8, 0.9, 0.93, 0.95, 0.97, 0.98, 1.0, 0.5, 0.0, 1.0, 0.7, 0.99])
    box = np.array([5.0, 5.0])
    still, moving = outlines.regular(11, (1.3, 2.5), 0.62), outlines.regular(12, (3.1, 2.62), 0.62)
    deck = f"neighbor 0.8 bin\npair_style circuloline 0.25 1.2 contact {form} walls 2 disks 3\n"
    deck += "pair_coeff 1 1 1.7 0.25\nrun 0\n"
    outlines.start(lmp, tmp_path, outlines.Scene([still, moving], box), deck)
    lmp.command("group moving molecule 2")
    at, touching = 0.0, 0
    for place in path:
        outlines.commands(lmp, f"displace_atoms moving move {place - at:.17g} 0 0\nrun {steps} pre no post no\n")
        at = place
        state = outlines.Scene([still, replace(moving, points=np.add(moving.points, (at, 0.0)))], box)
        found = np.array(lmp.gather_atoms("f", 1, 3)).reshape(-1, 3)[:, :2]
        assert found == pytest.approx(outlines.forces(state, form), abs=1e-12)
        touching += bool(list(outlines.contacts(state, form=form)))
    assert 5 < touching < len(path)
