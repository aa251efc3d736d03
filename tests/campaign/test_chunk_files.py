"""Files of several tasks: what goes in comes out, to the bit, and what is damaged is noticed."""

import dataclasses
import os

import h5py
import numpy as np
import pandas as pd
import pytest
from campaigns import assert_same, run_here, written
from chunk_files import KEYS, batch_of, content_of, in_chunks
from kinds_of_packings import KINDS
from twins import registered

import jamlab
from jamlab.campaign import states as making
from jamlab.campaign.folder import CampaignFolder
from jamlab.campaign.observables import SpectraOfStates, VoidsOfStates
from jamlab.campaign.task_file import TaskFile
from jamlab.errors import JamlabWarning, StorageError
from jamlab.packing.hdf5 import image_of
from jamlab.packing.packing import Packing
from jamlab.storage.verified_file import add_names, checksum, label_and_names, label_of
from jamlab.trajectories.convert import convert

FIELDS = [each.name for each in dataclasses.fields(Packing) if each.init]


def same(one, other):
    """Whether two values are the same to the last bit, of the same type, inside of containers too."""
    if isinstance(one, dict):
        return isinstance(other, dict) and one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, list):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, np.ndarray):
        return (one.dtype, one.shape, one.tobytes()) == (other.dtype, other.shape, other.tobytes())
    return type(one) is type(other) and repr(one) == repr(other)


def members(packing):
    """Packings of tasks: of one frame and of two; with the same state, and another one."""
    other = packing.with_state(positions=packing.positions + 1e-3, provenance={"seed": 8})
    return [[packing], [other, packing], [other]]


def kept(folder, batch, packings, tables=lambda k: {}):
    """Tasks with these packings in a folder; the second one lacks a state."""
    tasks = zip(batch.tasks(), packings, strict=True)
    lacking = [[], [{"state": "pressure 0.1", "reason": "µ was not met"}], *([[]] * len(packings))]
    contents = [content_of(task, frames, tables(k), lacking[k], k) for k, (task, frames) in enumerate(tasks)]
    return folder.keep(contents), contents


def in_files(tmp_path, packings, **how):
    """The same tasks as files of their own, and as files of several."""
    campaign, batch = batch_of(tmp_path / "c.toml", len(packings))
    paths, contents = kept(campaign.folder, batch, packings, **how)
    alone = CampaignFolder(tmp_path / "alone")
    alone.prepare()
    for content in contents:
        alone.keep([content])
    return campaign, dataclasses.replace(campaign, folder=alone), paths, contents


@pytest.mark.parametrize("name", KINDS)
def test_every_field_of_every_kind_of_packing_comes_back(tmp_path, name):
    packings = members(KINDS[name]())
    several, alone, paths, contents = in_files(tmp_path, packings)
    assert len(paths) == 1 and len(os.listdir(alone.folder.path / "tasks")) == 3
    for task in several.finished():
        for one, other in zip(several.packings(task), alone.packings(task), strict=True):
            for field in FIELDS:
                assert same(getattr(one, field), getattr(other, field)), field
        assert_same_task(several, alone, task)
    for content in contents:
        assert_holds(several, content)


def assert_holds(campaign, content):
    """Whether the folder holds what was put into it."""
    name, states = content.task.name, content.states
    file = campaign.folder.read_task(name)
    assert (file.task, file.parameters, file.seconds) == (name, content.task.parameters, content.seconds)
    assert (file.target_pressure.tolist(), file.converged.tolist()) == (states.target_pressures, states.converged)
    assert file.missing == states.missing and (name in campaign.folder.gaps([name])) == bool(states.missing)
    assert same(file.observables, content.measured) and same(file.tables, content.tables)
    assert campaign.packings(name) == states.packings  # to the last digit


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
        law, places = {"eps": 1.0, "bond": 10.0, "aspect": 0.5}, np.random.default_rng(1).random((8, 2))
        twins = jamlab.Packing("twin", 9 * np.eye(2), 9 * places, law, diameters=np.linspace(1.0, 1.5, 4))
        several, alone, *_ = in_files(tmp_path, members(twins))
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
    laws |= {"damping": np.array(["contact", "stokes"][:rows])}
    own = {"a": rng.random(1)} | ({"extra": rng.random(1)} if k == 3 else {})
    return {"voids": voids, "spectra": laws, "own:f": own}


def test_tables_of_any_length_and_type(tmp_path):
    packing = KINDS["energies eps"]()
    several, alone, paths, contents = in_files(tmp_path, [[packing]] * 6, tables=uneven)
    assert len(paths) == 3  # tasks 3 and 4 have files of their own
    for content in contents:
        assert_holds(several, content)
    for task in several.finished():
        assert_same_task(several, alone, task)
    for name in ("voids", "spectra"):
        pd.testing.assert_frame_equal(several.table(name), alone.table(name), check_exact=True)


@pytest.fixture
def chunk(tmp_path):
    """A folder with three tasks in one file, and the file."""
    campaign, batch = batch_of(tmp_path / "c.toml", 3)
    ((path,), _) = kept(campaign.folder, batch, members(KINDS["energies eps"]()))
    return campaign, path


def fresh(campaign):
    """The campaign as another process sees it."""
    return dataclasses.replace(campaign, folder=CampaignFolder(campaign.folder.path))


def changes(content, block):
    """Every sort of damage: a bit of each byte of the line and the names, of some of the rest; and of the length."""
    rng = np.random.default_rng(1)
    for place in [*range(block), *rng.integers(block, len(content), 200)]:
        yield content[:place] + bytes([content[place] ^ (1 << rng.integers(8))]) + content[place + 1 :]
    for length in (0, 1, 100, block - 1, block, len(content) // 2, len(content) - 1):
        yield content[:length]
    yield content + b"\0"
    yield content[block:]


def test_every_damage_of_a_file_of_several_is_noticed_and_all_its_tasks_run_again(chunk):
    campaign, path = chunk
    names, content = campaign.folder.finished(), path.read_bytes()
    assert len(names) == 3 and not fresh(campaign).folder.damages(names)
    for harmed in changes(content, 512):
        path.write_bytes(harmed)
        folder = fresh(campaign).folder
        assert [*folder.damages(names)] == [path.stem]
        assert folder.finished() in (names, set())
    (path.parent.parent / "damaged").mkdir()
    status = fresh(campaign).status(verify=True)
    assert list(status.damaged) == [path.stem]
    folder = fresh(campaign).folder
    assert folder.move_aside(path.stem).exists() and folder.finished() == set() and not folder.damages(names)


def test_names_that_fill_more_than_512_bytes(tmp_path):
    names, path = [f"{k:032x}" for k in range(100)], tmp_path / "a.h5"
    path.write_bytes(content := add_names(image_of(lambda file: None), names))
    assert label_and_names(path) == (label_of(names), names) and checksum(path) == (label_of(names), True)
    assert content.index(b"\x89HDF") == 4096 and h5py.File(path).userblock_size == 4096
    for place in (0, 50, 600, 3000, 4000):  # in the line, in names, in the zeros behind them
        path.write_bytes(content[:place] + bytes([content[place] ^ 1]) + content[place + 1 :])
        assert label_and_names(path) == ("", [])


def test_a_damaged_file_of_several_gives_no_rows(chunk):
    campaign, path = chunk
    name, content = campaign.finished()[0], bytearray(path.read_bytes())
    content[-1] ^= 1
    path.write_bytes(content)
    for look in (campaign.table, lambda: campaign.packings(name), lambda: campaign.folder.read_task(name)):
        with pytest.raises(StorageError, match="checksum"):
            look()
    assert campaign.folder.read([name]) == {} and campaign.folder.gaps([name]) == {}


@pytest.mark.parametrize("part", [slice(1), slice(0), slice(16), slice(1, 32), slice(34)])
def test_a_part_of_a_list_of_names_is_no_task(chunk, part):
    """Nor are two names."""
    campaign, _ = chunk
    name = "\n".join(campaign.folder.finished())[part]
    with pytest.raises(StorageError, match="cannot read"):
        campaign.packings(name)


def test_a_damaged_file_of_one_task_leaves_the_plan_of_chunks(chunk, tmp_path):
    campaign, _ = chunk
    task = [*batch_of(tmp_path / "c.toml", 4)[1].tasks()][3]
    (alone,) = campaign.folder.keep([content_of(task, members(KINDS["energies eps"]())[0])])
    alone.write_bytes(alone.read_bytes()[:-1])
    (line,) = batch_of(tmp_path / "c.toml", 9, chunk=3)[0].plan()
    assert (line.finished, line.files) == (4, 2) and line.seconds > 0 and line.bytes > 0


def test_a_task_in_two_files_is_one(chunk, tmp_path):
    """As when a driver died and the next one cut other chunks; with one file damaged the other counts."""
    campaign, path = chunk
    batch = batch_of(tmp_path / "c.toml", 3)[1]
    tasks, (packing,) = list(batch.tasks()), members(KINDS["energies eps"]())[0]
    (second,) = campaign.folder.keep([content_of(task, [packing]) for task in tasks[1:]])
    (third,) = campaign.folder.keep([content_of(tasks[0], [packing])])
    assert third == campaign.folder.task_file(tasks[0].name) and len({path, second, third}) == 3
    campaign = fresh(campaign)
    assert len(campaign.finished()) == 3 and campaign.status().foreign == 0
    rows = campaign.table("states")
    assert rows.groupby("task").ngroups == 3 and not rows.duplicated(["task", "state"]).any()
    assert campaign.folder.file_of(tasks[0].name) == third
    path.write_bytes(path.read_bytes()[:-1])
    damages = fresh(campaign).folder.damages([task.name for task in tasks])
    assert [*damages] == [path.stem] and "(3 tasks)" in damages[path.stem]
    campaign.folder.move_aside(path.stem)
    assert len(fresh(campaign).finished()) == 3 and len(campaign.table("states")) == 3


@pytest.mark.parametrize("harm", [lambda path: path.mkdir(), os.mkfifo, lambda path: path.write_text("hello" * 1000)])
def test_what_bears_the_name_of_a_file_of_several_is_damaged(chunk, harm):
    campaign, path = chunk
    harm(other := path.with_name(f"chunk-{'0' * 32}.h5"))
    assert [*campaign.folder.damages(campaign.finished())] == [other.stem] and len(campaign.finished()) == 3
    assert campaign.folder.move_aside(other.stem).parent.name == "damaged" and not other.exists()


def test_a_file_of_several_under_another_name_is_not_taken_for_one(chunk):
    campaign, path = chunk
    path.rename(other := path.with_name(f"chunk-{'0' * 32}.h5"))
    campaign = fresh(campaign)
    assert campaign.finished() == []
    assert path.stem.replace("-", " ") in campaign.folder.damages([])[other.stem]


def test_a_newer_layout_is_refused(chunk, monkeypatch):
    campaign, _ = chunk
    monkeypatch.setattr("jamlab.campaign.chunk_file.CHUNK_VERSION", 0)
    with pytest.raises(StorageError, match="install jamlab"):
        campaign.table("states")
    assert campaign.folder.damages(campaign.finished()) == {}


def test_a_file_of_several_tasks_is_no_file_of_packings(chunk, tmp_path):
    """It says what it is, and how to get its packings."""
    campaign, path = chunk
    looks = [jamlab.read, jamlab.read_all, jamlab.universe, lambda path: convert(path, tmp_path / "x.xyz")]
    for look in looks:
        with pytest.raises(StorageError, match=r"several tasks of a campaign.*packings") as caught:
            look(path)
        assert str(path) in str(caught.value)
    assert campaign.packings(campaign.finished()[0])


def test_packings_in_a_file_of_several_are_not_made_again(tmp_path, monkeypatch):
    """A new observable takes them from there."""
    before, _ = batch_of(tmp_path / "c.toml", 3)
    run_here(before)
    several = in_chunks(before, tmp_path / "several")
    more = jamlab.open_campaign(
        written(tmp_path / "d.toml", **KEYS, seeds=3, observables=["voids"]), several.folder.path
    )
    assert [line.stored for line in more.plan()] == [3]
    monkeypatch.setattr(making, "make", None)
    assert {outcome.state for outcome in run_here(more)} == {"finished"}
    states = more.table("states").drop(columns="task")
    pd.testing.assert_frame_equal(states, before.table("states").drop(columns="task"), check_exact=True)


@pytest.mark.slow
def test_an_export_in_parts_is_that_of_the_whole(tmp_path, monkeypatch):
    """Whatever types and columns the parts have; with one warning of all negative moduli."""
    campaign, _, _, contents = in_files(tmp_path, [[KINDS["energies eps"]()]] * 6, tables=uneven)
    for k, content in enumerate(contents):
        content.measured["g"][:] = k - 2.0
    campaign.folder.keep(contents)
    for format in ("csv", "tsv"):
        files = []
        for size in (2, 100):
            monkeypatch.setattr("jamlab.campaign.tables.TASKS_AT_A_TIME", size)
            with pytest.warns(JamlabWarning) as said:
                paths = campaign.export(tmp_path / f"{format}{size}", ("states", "voids", "spectra"), format=format)
            texts = [str(each.message) for each in said]
            files.append((texts, {path.name: path.read_text() for path in paths}))
        assert files[0] == files[1]
        assert len(files[0][0]) == 1 and {*files[0][1]} == {
            f"{name}.{format}" for name in ("states", "voids", "spectra")
        }
