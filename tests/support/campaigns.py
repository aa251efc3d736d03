"""Campaign files for the tests, and campaigns that run in this process."""

import json

import pandas as pd
from threadpoolctl import threadpool_limits

from jamlab.campaign.campaign_text import read_text
from jamlab.campaign.file import CampaignTable, check_campaign
from jamlab.campaign.observables import TABLES
from jamlab.campaign.tasks import batches, states_name
from jamlab.campaign.workers import run_tasks


def read_campaign_file(path) -> CampaignTable:
    """Read and check a campaign file."""
    return check_campaign(read_text(path), path)


SWEEP = {"name": "disks", "model": "sp", "n": 16, "seeds": 2, "compress": {"to": 0.9, "step": 0.02}}
FULL = """
name = "full"

[[sweep]]
name = "up"
model = "sp"
n = [8, 10]
seeds = [3, 4]
compress = { to = 0.9, step = 0.02, first_step = 1e-3 }
observables = ["voids"]

[[sweep]]
name = "sheared"
model = "sp"
n = 32
seeds = [3]
ensemble = "shear-stabilized"
pressures = [1e-3, 1e-2]
observables = ["spectra", "quasistatic", "correlation"]
damping = { contact = [1.0], stokes = [2.0] }
prestress = [true, false]
omega = [1e-3, 1.0]
correlation_omega = [1e-2]

[[sweep]]
name = "droplets"
model = "dp"
n = 8
seeds = [1]
onset = true
law = { gamma = 0.12 }
"""


def written(path, name="c", **changes):
    """A campaign file of one sweep; None takes a key out."""
    sweep = {key: value for key, value in (SWEEP | changes).items() if value is not None}
    lines = [f'name = "{name}"', "[[sweep]]", *(f"{key} = {toml(value)}" for key, value in sweep.items())]
    path.write_text("\n".join(lines) + "\n")
    return path


def toml(value):
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {toml(entry)}" for key, entry in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return json.dumps(value)


def names(path, only=None):
    return [task.name for batch in batches(read_campaign_file(path), only) for task in batch.tasks()]


def run_here(campaign):
    """All tasks in this process, with one thread, as workers have."""
    campaign.folder.prepare()
    campaign.folder.keep_copy(campaign.text, campaign.name)
    outcomes = []
    for batch in batches(campaign.content):
        for seed in batch.seeds:
            if not campaign.folder.has_ended(name := batch.name_of(seed)):
                stored = [other for other in campaign.folder.finished() if states_name(other) == states_name(name)]
                modules = [str(campaign.file.parent)]
                with threadpool_limits(1):
                    outcomes += run_tasks(campaign.folder, batch.part([seed]), {name: stored}, modules)
    return outcomes


def assert_same(one, other, tables=TABLES):
    """Two finished campaigns hold the same packings and tables, bit by bit, but for times."""
    assert one.finished() == other.finished()
    for name in tables:
        first, second = (c.table(name).drop(columns=["seconds"], errors="ignore") for c in (one, other))
        pd.testing.assert_frame_equal(first, second, check_exact=True)
    for name in one.finished():
        for p, q in zip(one.packings(name), other.packings(name), strict=True):
            assert (p.positions.tobytes(), p.box.tobytes()) == (q.positions.tobytes(), q.box.tobytes())
