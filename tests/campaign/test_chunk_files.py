"""Files of several tasks: what goes in comes out, to the bit, and what is damaged is noticed."""

import dataclasses
import os

import numpy as np
import pandas as pd
import pytest
from campaigns import assert_same
from chunk_files import batch_of, content_of, in_chunks
from kinds_of_packings import KINDS
from twins import registered

import jamlab
from jamlab.campaign.folder import CampaignFolder
from jamlab.campaign.observables import SpectraOfStates, VoidsOfStates
from jamlab.campaign.task_file import TaskFile
from jamlab.packing.packing import Packing

FIELDS = [each.name for each in dataclasses.fields(Packing) if each.init]


def same(one, other):
    """Whether two values are the same to the last bit, of the same type, inside of containers too."""
    if isinstance(one, dict):
        return isinstance(other, dict) and [*one] == [*other] and all(same(one[key], other[key]) for key in one)
    if isinstance(one, list):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, np.ndarray):
        return (one.dtype, one.shape, one.tobytes()) == (other.dtype, other.shape, other.tobytes())
    return type(one) is type(other) and repr(one) == repr(other)


def members(packing):
    """Packings of tasks: of one frame and of two; with the same state, and another one."""
    other = packing.with_state(positions=packing.positions + 1e-3, provenance={"seed": 8})
    return [[packing], [other, packing], [other]]


def kept(folder, batch, packings, tables=lambda k: {}, missing=()):
    """Tasks with these packings in a folder."""
    tasks = zip(batch.tasks(), packings, strict=True)
    contents = [content_of(task, frames, tables(k), missing, k) for k, (task, frames) in enumerate(tasks)]
    return folder.keep(contents), contents


def in_files(tmp_path, packings, **how):
    """The same tasks as files of their own, and as files of several."""
    campaign, batch = batch_of(tmp_path / "c.toml", len(packings))
    paths, contents = kept(campaign.folder, batch, packings, **how)
    alone = CampaignFolder(tmp_path / "alone")
    alone.prepare()
    for content in contents:
        alone.keep([content])
    return campaign, dataclasses.replace(campaign, folder=alone), paths


@pytest.mark.parametrize("name", KINDS)
def test_every_field_of_every_kind_of_packing_comes_back(tmp_path, name):
    packings = members(KINDS[name]())
    several, alone, paths = in_files(tmp_path, packings)
    assert len(paths) == 1 and len(os.listdir(alone.folder.path / "tasks")) == 3
    for task in several.finished():
        for one, other in zip(several.packings(task), alone.packings(task), strict=True):
            for field in FIELDS:
                assert same(getattr(one, field), getattr(other, field)), field
        assert_same_task(several, alone, task)


def assert_same_task(one, other, task):
    first, second = one.folder.read_task(task), other.folder.read_task(task)
    for field in dataclasses.fields(TaskFile):
        assert same(getattr(first, field.name), getattr(second, field.name)), field.name


def test_the_kinds_of_packings_have_every_field():
    """So that one that files of several tasks lose would be noticed."""
    made = [make() for make in KINDS.values()]
    for field in FIELDS:
        assert len({repr(getattr(packing, field)) for packing in made}) > 1, field


def test_packings_of_a_model_from_outside_come_back(tmp_path):
    with registered():
        twins = jamlab.jam(n=4, model="twin", seed=1, bond=10.0, aspect=0.5)
        several, alone, _ = in_files(tmp_path, members(twins))
        for task in several.finished():
            for one, other in zip(several.packings(task), alone.packings(task), strict=True):
                assert all(same(getattr(one, field), getattr(other, field)) for field in FIELDS)


def test_a_campaign_in_files_of_several_tasks_is_the_same(full, tmp_path):
    other = in_chunks(full, tmp_path / "c")
    names = os.listdir(other.folder.path / "tasks")
    assert sorted(name.startswith("chunk-") for name in names) == [False, False, True, True]
    assert_same(full, other)
    found = other.status(verify=True)
    assert (found.finished, found.left, found.damaged, found.gaps, found.foreign) == (6, 0, {}, {}, 0)
    assert {name: file.seconds for name, file in full.folder.read(full.finished()).items()} == {
        name: file.seconds for name, file in other.folder.read(other.finished()).items()
    }


def uneven(k):
    """Tables of a task: rows as many as it likes, text, nan, and another type or column where k is 3 or 4."""
    rng, rows = np.random.default_rng(k), 1 + k % 2
    voids = {name: rng.random(k) for name in VoidsOfStates.columns}
    voids |= {"state": np.zeros(k, dtype=int)} | ({} if k == 4 else {"sides": rng.integers(3, 9, k)})
    laws = {name: np.full(rows, [np.nan, 1.0][k % 2]) for name in SpectraOfStates.columns}
    laws |= {"law": np.array(["contact", "stokes"][:rows])}
    own = {"a": rng.random(1)} | ({"extra": rng.random(1)} if k == 3 else {})
    return {"voids": voids, "spectra": laws, "own:f": own}


def test_tables_of_any_length_and_type(tmp_path):
    packing = KINDS["energies eps"]()
    several, alone, paths = in_files(tmp_path, [[packing]] * 6, tables=uneven)
    assert len(paths) == 3  # tasks 3 and 4 have files of their own
    for task in several.finished():
        assert_same_task(several, alone, task)
    for name in ("voids", "spectra"):
        pd.testing.assert_frame_equal(several.table(name), alone.table(name), check_exact=True)
