"""What `plan` says before a task has run: pieces of work, times what a piece takes by the shipped table."""

import json
from pathlib import Path

import numpy as np
import pytest
from campaigns import written
from commands import call

from jamlab.campaign import cost
from jamlab.campaign.observables import OBSERVABLES
from jamlab.campaign.open_campaign import open_campaign
from jamlab.campaign.plan import seconds_each, total_time
from jamlab.campaign.states import make_states
from jamlab.campaign.tasks import batches

pytestmark = pytest.mark.usefixtures("here")
CAMPAIGNS = sorted((Path(__file__).parents[2] / "studies/campaigns").glob("*.toml"))


def batch_of(path, **keys):
    (batch,) = batches(open_campaign(written(path, **keys)).content)
    return batch


def test_every_shipped_campaign_has_an_estimate():
    """And names what it leaves out: own observables, and parameters of droplets."""
    for file in CAMPAIGNS:
        lines = open_campaign(file, "nowhere").plan()
        assert all(line.estimated and 0 < line.seconds < 1e7 for line in lines)
        left_out = {name for line in lines for name in line.without}
        own = {name for line in batches(open_campaign(file).content) for name in line.parameters.own}
        assert own <= left_out <= own | {"law"}
    laws = {line.sweep: line.without for line in open_campaign(CAMPAIGNS[1]).plan()}
    assert laws["vertices-24-onsets"] == () and laws["stiff-rims-onsets"] == ("law",)


def test_states_are_counted(tmp_path):
    """Those of a compression within a few, of pressures and phi exactly."""
    sweep = {"to": 0.92, "step": 0.02, "first_step": 1e-3, "per_decade": 4}
    parameters = batch_of(tmp_path / "c.toml", model="sp", n=16, seeds=1, compress=sweep).parameters
    assert cost.count_states(parameters) == pytest.approx(len(make_states(parameters).packings), abs=3)
    keys = {"model": "sp", "n": 16, "seeds": 1, "compress": None}
    assert cost.count_states(batch_of(tmp_path / "p.toml", **keys, pressures=[1e-2, 1e-3]).parameters) == 2
    assert cost.count_states(batch_of(tmp_path / "f.toml", **keys, phi=[0.8, 0.82, 0.84]).parameters) == 3


def test_pieces_between_sizes_follow_powers(monkeypatch, tmp_path):
    """And beyond them; a table without the packings has no estimate, one without an observable names it."""
    table = {"sp onset": ([10, 100, 1000], [1.0, 10.0, 1000.0]), "sp states": ([10], [0.5])}
    monkeypatch.setattr(cost, "_table", lambda: ({}, table))
    keys = {"model": "sp", "seeds": 1, "compress": None, "onset": True}
    for n, making in ((10, 1.0), (40, 4.0), (400, 160.0), (10_000, 1e5), (4, 0.4)):
        found = cost.estimate_task(batch_of(tmp_path / "c.toml", **keys, n=n))
        assert (found.making, found.measuring) == (pytest.approx(making), pytest.approx(0.05 * n))
    found = cost.estimate_task(batch_of(tmp_path / "c.toml", **keys, n=10, observables=["voids"]))
    assert (found.making, found.measuring, found.without) == (pytest.approx(1.0), pytest.approx(0.5), ("voids",))
    (line,) = open_campaign(written(tmp_path / "c.toml", **keys | {"model": "dp"}, n=10)).plan()
    assert line.seconds is None and not line.estimated and total_time([line])[:2] == (None, None)


def test_vertices_count_as_particles(tmp_path):
    keys = {"model": "dp", "seeds": 1, "compress": None, "onset": True}
    twice = cost.estimate_task(batch_of(tmp_path / "c.toml", **keys, n=16, law={"nv_small": 24, "nv_large": 34}))
    assert twice == cost.estimate_task(batch_of(tmp_path / "c.toml", **keys, n=32)) and not twice.without


def test_pressures_lie_between_those_measured(tmp_path):
    """The cost of a packing rises as the pressure falls; beyond the lowest one measured it is held."""
    keys = {"model": "sp", "n": 64, "seeds": 1, "compress": None}
    costs = [
        cost.estimate_task(batch_of(tmp_path / "c.toml", **keys, pressures=[p])).making
        for p in (0.1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-7)
    ]
    assert np.all(np.diff(costs) >= 0) and costs[1] < costs[2] == pytest.approx((costs[1] + costs[3]) / 2)
    assert costs[0] == costs[1] and costs[4] == costs[5]


def test_what_is_not_in_an_estimate_is_named(tmp_path):
    keys = {"model": "sp", "n": 16, "seeds": 2, "compress": None, "pressures": [1e-2]}
    own = {"observables": ["creep", "jamlab:shear_modulus"], "creep": {"stresses": [1e-3], "duration": 10.0}}
    more = {"changes": [["swap_sizes", {"sweeps": 10}]], "sizes": "lognormal:0.3", "law": {"exponent": 2.5}}
    found = cost.estimate_task(batch_of(tmp_path / "c.toml", **keys, **own, **more))
    assert found.without == ("jamlab:shear_modulus", "change 'swap_sizes'", "law", "sizes", "creep")
    written(tmp_path / "c.toml", **keys, **own)
    said = call(tmp_path, "campaign", "plan", "c.toml").stdout
    assert "leaves out creep of sweep disks: cost unknown" in said and "this machine is not measured" in said
    (line,) = json.loads(call(tmp_path, "campaign", "plan", "c.toml", "--json").stdout)["sweeps"]
    assert line["estimated"] and line["without"] == ["jamlab:shear_modulus", "creep"]


def test_a_finished_task_takes_the_place_of_the_estimate(tmp_path):
    """Chunks are cut by measured times alone."""
    campaign = open_campaign(written(tmp_path / "c.toml", model="sp", n=8, seeds=3, compress=None, pressures=[1e-2]))
    (line,) = campaign.plan()
    whole = cost.estimate_task(batches(campaign.content)[0])
    assert line.estimated and line.seconds == pytest.approx(3 * (whole.making + whole.measuring))
    assert total_time([line], 1)[0] == line.seconds and not seconds_each(batches(campaign.content), campaign.folder)
    campaign.run(1, pilot=True)
    (line,) = campaign.plan()
    assert not line.estimated and line.seconds > 0 and seconds_each(batches(campaign.content), campaign.folder)
    assert "~" not in call(tmp_path, "campaign", "plan", "c.toml").stdout


def test_more_work_has_a_larger_amount():
    """Of every observable that has keys of how much is driven."""
    given = {
        "flow": [{"rates": [1e-2], "strain": strain} for strain in (2.0, 4.0)] + [{"rates": [1e-2, 1e-5]}],
        "oscillation": [
            {"omega": [1.0], "amplitudes": [1e-3], "cycles": cycles, "tolerance": tolerance}
            for cycles, tolerance in ((4, 1e-2), (8, 1e-2), (8, 1e-3))
        ],
        "quasistatic_shear": [{"strain": 2.0}, {"strain": 2.0, "strain_step": 1e-4}],
        "plastic_events": [{"strain": 0.02}, {"strain": 0.04}],
        "cyclic_shear": [{"amplitudes": [0.02]}, {"amplitudes": [0.02, 0.03]}],
    }
    for name, tables in given.items():
        amounts = [OBSERVABLES[name](**{name: table}).amount() for table in tables]
        assert amounts == sorted(set(amounts)), name
    few, many = (OBSERVABLES["correlation"](correlation_omega=[1.0] * 1 + more) for more in ([], [2.0, 3.0]))
    assert many.amount() == 3 * few.amount() == 3


def test_the_table_has_every_piece_of_disks_and_says_where_it_was_measured():
    """At two sizes or more, from which powers follow; creep takes as long as it takes."""
    facts, pieces = cost._table()
    assert facts.keys() == {"commit", "date", "machine"}
    assert {name for name in OBSERVABLES if f"sp {name}" not in pieces} == {"creep", "modes"}
    assert all(sizes == sorted(set(sizes)) and min(seconds) > 0 for sizes, seconds in pieces.values())
