"""Tasks by hand, and the tasks of a campaign in files of several."""

from pathlib import Path

import numpy as np
from campaigns import written

import jamlab
from jamlab.campaign.file import check_campaign
from jamlab.campaign.observable import TaskStates
from jamlab.campaign.task_file import TaskContent
from jamlab.campaign.tasks import batches
from jamlab.packing.quantities import COLUMNS

KEYS = {"n": 16, "compress": None, "pressures": [1e-2]}  # of a sweep


def batch_of(path, count, **keys):
    """The batch of a campaign file with so many seeds, and the campaign."""
    campaign = jamlab.open_campaign(written(path, seeds=count, **KEYS | keys))
    campaign.folder.prepare()
    (batch,) = batches(campaign.content)
    return campaign, batch


def content_of(task, packings, tables=None, missing=(), seed=0):
    """A finished task with packings and tables by hand; numbers measured at random."""
    rng, count = np.random.default_rng(seed), len(packings)
    measured = {name: rng.random(count) for name in COLUMNS}
    states = TaskStates(packings, rng.random(count).tolist(), (rng.random(count) > 0.5).tolist(), list(missing))
    return TaskContent(task, states, measured, tables or {}, float(rng.random()))


def in_chunks(campaign, folder, most=100):
    """The same finished tasks in files of several; the campaign of this folder."""
    path = Path(folder)
    path.mkdir()
    other = type(campaign)(campaign.file, campaign.text, campaign.content, type(campaign.folder)(path))
    other.folder.prepare()
    other.folder.keep_copy(campaign.text, campaign.name)
    for batch in batches(check_campaign(campaign.text, campaign.file)):
        done = [stored(campaign, task) for task in batch.tasks() if task.name in campaign.folder.finished()]
        for k in range(0, len(done), most):
            other.folder.keep(done[k : k + most])
    return other


def stored(campaign, task):
    """What the folder holds of a task."""
    file = campaign.folder.read_task(task.name)
    states = TaskStates(
        campaign.folder.packings(task.name), file.target_pressure.tolist(), file.converged.tolist(), file.missing
    )
    return TaskContent(task, states, file.observables, file.tables, file.seconds)
