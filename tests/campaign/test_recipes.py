"""Packings of campaigns have a recipe, from which the same bits are made again."""

import numpy as np
import pytest
from campaigns import run_here, written

import jamlab
from jamlab.campaign.tasks import batches

ONSET = {"compress": None, "onset": True}
SWEEPS = {
    "onset": ONSET | {"n": 12, "step": 0.02},
    "droplets": ONSET | {"model": "dp", "n": 8, "law": {"gamma": 0.3}},
    "sizes": ONSET | {"n": 12, "sizes": "lognormal:0.2", "ensemble": "shear-stabilized"},
    "two sizes": ONSET | {"n": 16, "size_ratio": 1.2, "fraction_large": 0.25, "force_tolerance": 1e-11},
    "compressed": {"n": 12, "compress": {"to": 0.9, "step": 0.02, "first_step": 1e-3}},
    "by pressure": {"n": 12, "compress": {"to": 0.88, "step": 0.02, "pressure_tolerance": 1e-2}},
    "confluence": {"model": "dp", "n": 8, "compress": {"to": 0.99, "step": 0.03, "confluence": 5e-3}},
    "above onset": {"n": 12, "compress": {"above_onset": 1e-2, "step": 0.02, "first_step": 1e-3}},
    "pressures": {"n": 12, "compress": None, "pressures": [1e-2, 1e-3], "law": "hertz"},
    "decompressed": {"n": 12, "compress": None, "pressures": [1e-2, 3e-3, 1e-3], "decompress": True},
    "phi": {"n": 12, "compress": None, "phi": [0.7, 0.9], "units": "eps", "ensemble": "shear-stabilized"},
}


def packings_of(path, **keys):
    """All packings of a campaign that runs here, with the tasks they are of."""
    campaign = jamlab.open_campaign(written(path, **keys))
    assert {outcome.state for outcome in run_here(campaign)} == {"finished"}
    tasks = {task.name: task for batch in batches(campaign.content) for task in batch.tasks()}
    return [(tasks[name], packing) for name in campaign.finished() for packing in campaign.packings(name)]


def assert_made_again(found):
    for task, packing in found:
        again = jamlab.make(packing.recipe)
        assert again == packing and again.max_force == packing.max_force and again.recipe == packing.recipe
        known = {name: getattr(task.parameters.recipe, name) for name in ("protocol", "n", "model", "seed", "sizes")}
        assert {name: getattr(packing.recipe, name) for name in known} == known


@pytest.mark.parametrize("chunk", [pytest.param(1, marks=pytest.mark.slow), 2])
def test_a_packing_of_a_campaign_is_made_again_from_its_recipe(tmp_path, chunk):
    found = packings_of(tmp_path / "c.toml", **SWEEPS["phi"], chunk=chunk)
    assert len(found) == 4 and {packing.units for _, packing in found} == {"eps"}
    sheared = [packing for _, packing in found if packing.phi > 0.8]
    assert len(sheared) == 2 and all(abs(jamlab.evaluate(packing).stress[0, 1]) < 1e-10 for packing in sheared)
    assert all(packing.box[1, 0] != 0 for packing in sheared)
    assert_made_again(found)


@pytest.mark.slow
@pytest.mark.parametrize("chunk", [1, 2])
@pytest.mark.parametrize("sweep", SWEEPS.values(), ids=SWEEPS.keys())
def test_ten_sweeps_are_made_again_from_recipes(tmp_path, sweep, chunk):
    assert_made_again(packings_of(tmp_path / "c.toml", **sweep, chunk=chunk))


def test_the_name_of_a_task_follows_from_its_recipe_and_what_is_measured(tmp_path):
    def name(**keys):
        return next(batches(jamlab.open_campaign(written(tmp_path / "c.toml", **ONSET, **keys)).content)[0].names())

    plain = name()
    for usual in ({"law": {"exponent": 2.0}}, {"search": "bisection"}, {"start": "from-disks"}, {"law": "harmonic"}):
        assert name(**usual) == plain, usual
    assert name(ranks=2) == plain
    changed = ({"law": "hertz"}, {"step": 0.02}, {"search": "incremental"}, {"size_ratio": 1.3}, {"units": "k"})
    assert len({plain, *(name(**keys) for keys in changed)}) == 1 + len(changed)


def test_a_sweep_ends_at_a_distance_from_each_onset(tmp_path):
    """Not at one packing fraction, as onsets differ."""
    found = packings_of(tmp_path / "c.toml", n=12, seeds=2, compress={"above_onset": 1e-2, "step": 5e-3})
    ends = {}
    for task, packing in found:
        ends.setdefault(task.parameters.seed, []).append(jamlab.packing_fraction(packing))
    distances = [np.subtract(rho, rho[0]) for rho in ends.values()]
    np.testing.assert_allclose(distances, [[0, 5e-3, 1e-2]] * 2, atol=5e-5)
    assert abs(ends[1][0] - ends[2][0]) > 1e-4
