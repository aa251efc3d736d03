"""Chunks of tasks: every task once, none larger than it should be, and no worker that waits long at the end."""

import heapq
import itertools
import pickle
import random
import time

import pytest
from campaigns import assert_same, read_campaign_file, written

import jamlab
from jamlab.campaign import chunks
from jamlab.campaign.chunk_file import names_in_chunk
from jamlab.campaign.chunks import RULES, Cutter
from jamlab.campaign.tasks import batches, states_name, task_names
from jamlab.errors import InputError

SMALL = {"compress": None, "onset": True, "n": 16}


def batches_of(tmp_path, **changes):
    return batches(read_campaign_file(written(tmp_path / "c.toml", **SMALL | changes)))


def cut(cutter, busy=frozenset()):
    while (chunk := cutter.next(busy)) is not None:
        yield chunk


def run(cutter, workers, seconds, waiting=1):
    """Hand chunks to workers, as the driver does: so many wait for each worker. Return the wall time, the time that it
    would take if all workers worked to the end, and the chunks."""
    free, running, queued, handed, now, work = workers, [], [], [], 0.0, 0.0
    while True:
        while len(queued) + len(running) < workers * waiting and (chunk := cutter.next()) is not None:
            queued.append(chunk)
        while queued and free:
            took = sum(map(seconds, queued[0].seeds))
            handed.append(queued.pop(0))
            heapq.heappush(running, (now + took, len(handed) - 1, took))
            free, work = free - 1, work + took
        if not running:
            return now, work / workers, handed
        now, index, took = heapq.heappop(running)
        free += 1
        cutter.learn(handed[index], took)


@pytest.mark.parametrize("seeds", [3_000, {"first": 7, "last": 3_006}, [*range(10_000, 4_000, -2)]])
def test_every_task_is_cut_once(tmp_path, seeds):
    chosen = batches_of(tmp_path, seeds=seeds, n=[16, 20])
    wanted = {name for name in task_names(chosen) if int(name, 16) % 3}  # others are finished, or of other shares
    cutter = Cutter(chosen, wanted, lambda: 2, {chosen[0].name: 0.02})
    assert len(cutter) == len(wanted)
    names = []
    for chunk in cut(cutter):
        names += chunk.names()
        cutter.learn(chunk, float("nan"))  # of the other batch no time is ever known
    assert len(names) == len(set(names)) and set(names) == wanted
    assert len(cutter) == 0 and cutter.next() is None


def test_few_seeds_are_tasks_of_their_own(tmp_path):
    (chosen,) = batches_of(tmp_path, seeds=RULES.fewest - 1)
    cutter = Cutter([chosen], task_names([chosen]), lambda: 1, {chosen.name: 1e-3})
    assert {len(chunk.seeds) for chunk in cut(cutter)} == {1}


def test_shares_of_a_large_sweep_are_chunks_too(tmp_path):
    (chosen,) = batches_of(tmp_path, seeds=100_000)
    share = set(itertools.islice(chosen.names(), 4, None, 200))  # 500 tasks, every 200th seed
    handed = list(cut(Cutter([chosen], share, lambda: 1, {chosen.name: 0.02})))
    assert len(handed) < 20
    assert set(task_names(handed)) == share


def test_first_tasks_go_alone_until_their_time_is_known(tmp_path):
    (chosen,) = batches_of(tmp_path, seeds=50_000)
    cutter = Cutter([chosen], task_names([chosen]), lambda: 2, {})
    assert cutter.seconds_of(chosen.name) is None
    first = [cutter.next() for _ in range(4)]
    assert [len(chunk.seeds) for chunk in first] == [1] * 4
    cutter.learn(first[0], float("nan"))  # its worker died
    assert len(cutter.next().seeds) == 1
    cutter.learn(first[1], 0.05)
    second = cutter.next()
    assert len(second.seeds) == RULES.growth  # the time of a single task may be untypical
    cutter.learn(second, 0.05 * RULES.growth)
    assert len(cutter.next().seeds) == RULES.seconds / 0.05
    assert cutter.seconds_of(chosen.name) == pytest.approx(0.05)


def test_few_tasks_go_alone_to_a_cluster_that_takes_any_number(tmp_path):
    chosen = batches_of(tmp_path, seeds=5_000, n=[32, 16])
    cutter = Cutter(chosen, task_names(chosen), lambda: 3, {})
    first = list(cut(cutter))
    assert [chunk.name for chunk in first] == [chosen[0].name] * 64 + [chosen[1].name] * 64
    cutter.learn(first[0], 0.1)
    second = cutter.next()
    assert second.name == chosen[0].name and len(second.seeds) == RULES.growth


def test_a_first_time_that_is_too_long_is_forgotten(tmp_path):
    """The first task of a worker imports what all need."""
    (chosen,) = batches_of(tmp_path, seeds=100_000)
    cutter = Cutter([chosen], task_names([chosen]), lambda: 2, {chosen.name: 2.0})
    *_, handed = run(cutter, 2, lambda seed: 0.02)
    longest = max(len(chunk.seeds) for chunk in handed)
    assert 400 < longest <= RULES.seconds / 0.02
    assert len(handed) < 2 * 2000 / RULES.seconds + 60


@pytest.mark.parametrize("workers", [1, 8, 64])
def test_workers_end_together(tmp_path, workers):
    """Times of seeds differ tenfold, and two sweeps of different n follow one another."""
    chosen = batches_of(tmp_path, seeds=20_000, n=[32, 16])
    pick = random.Random(4)
    times = [0.02 * 10 ** pick.random() for _ in range(20_001)]
    cutter = Cutter(chosen, task_names(chosen), lambda: workers, {})
    wall, ideal, handed = run(cutter, workers, times.__getitem__, waiting=2)
    assert wall < ideal + 2 * RULES.shortest + 0.02 * ideal
    work = ideal * workers
    assert len(handed) < 2 * work / RULES.seconds + 20 * workers  # no more calls and files than it takes
    mean = work / 40_000
    assert max(len(chunk.seeds) for chunk in handed) * mean < 1.6 * RULES.seconds


def test_a_known_chunk_is_kept(tmp_path):
    (chosen,) = batches_of(tmp_path, seeds=25, chunk=10)
    cutter = Cutter([chosen], task_names([chosen]), lambda: 8, {chosen.name: 1000.0})
    assert [len(chunk.seeds) for chunk in cut(cutter)] == [10, 10, 5]
    (chosen,) = batches_of(tmp_path, seeds=25, chunk=1000)  # larger than the sweep
    assert [len(chunk.seeds) for chunk in cut(Cutter([chosen], task_names([chosen]), lambda: 8, {}))] == [25]


def test_large_packings_make_small_chunks(tmp_path, monkeypatch):
    how = {"seeds": 2_000, "chunk": 1_000, "n": 1024, "onset": None, "compress": {"to": 0.9, "step": 0.01}}
    (chosen,) = batches_of(tmp_path, **how)
    chunk = Cutter([chosen], task_names([chosen]), lambda: 8, {}).next()
    states, floats = 40, 3 * 1024  # of positions and diameters
    assert 8 * floats * states * len(chunk.seeds) < RULES.bytes
    assert 10 < len(chunk.seeds) < 100
    monkeypatch.setattr(chunks, "RULES", chunks.ChunkRules(bytes=1))
    assert len(Cutter([chosen], task_names([chosen]), lambda: 8, {}).next().seeds) == 1


def test_the_same_packings_are_not_made_twice_at_a_time(tmp_path):
    """Sweeps that differ in what they measure: the second waits for the packings of the first."""
    text = written(tmp_path / "c.toml", **SMALL, seeds=2_000, chunk=500).read_text()
    voids = f'observables = ["voids"]\n{text.partition("[[")[1]}{text.partition("[[")[2]}'
    (tmp_path / "c.toml").write_text(text.replace('"disks"', '"first"') + voids)
    chosen = batches(read_campaign_file(tmp_path / "c.toml"))
    cutter = Cutter(chosen, task_names(chosen), lambda: 2, {})
    first = [cutter.next() for _ in range(4)]
    busy = {states_name(name) for chunk in first for name in chunk.names()}
    assert len(busy) == 2_000 and len(cutter) == 2_000
    assert cutter.next(busy) is None
    busy -= {states_name(name) for name in first[2].names()}
    second = cutter.next(busy)
    assert second.sweep == "disks" and second.seeds == first[2].seeds
    assert cutter.next(busy | {states_name(name) for name in second.names()}) is None
    assert {*task_names([*first, second, *cut(cutter)])} == task_names(chosen)


def test_a_task_of_two_sweeps_is_cut_once(tmp_path):
    text = written(tmp_path / "c.toml", **SMALL, seeds=1_500).read_text()
    again = text.partition("\n")[2].replace('"disks"', '"again"').replace("1500", "{ first = 1000, last = 2500 }")
    (tmp_path / "c.toml").write_text(text + again)
    chosen = batches(read_campaign_file(tmp_path / "c.toml"))
    handed = list(cut(Cutter(chosen, task_names(chosen), lambda: 2, {batch.name: 0.05 for batch in chosen})))
    seeds = sorted(seed for chunk in handed for seed in chunk.seeds)
    assert seeds == [*range(1, 2501)]


def test_chunks_are_sent_in_few_bytes_and_keep_their_names(tmp_path):
    (chosen,) = batches_of(tmp_path, seeds=100_000)
    cutter = Cutter([chosen], task_names([chosen]), lambda: 2, {chosen.name: 2e-3})
    cutter.learn(chosen.first(1_000), 2.0)
    chunk = cutter.next()
    assert len(chunk.seeds) == 5_000
    names = list(chunk.names())  # and its hashes are known
    sent = pickle.dumps(chunk)
    assert list(pickle.loads(sent).names()) == names == [chosen.name_of(seed) for seed in chunk.seeds]
    assert len(sent) < 5_000


@pytest.mark.parametrize("chunk", [0, -1, 2.5, "all", 10_001])
def test_no_such_chunk(tmp_path, chunk):
    with pytest.raises(InputError, match="chunk"):
        batches_of(tmp_path, chunk=chunk)


def test_names_of_tasks_do_not_depend_on_chunks(tmp_path):
    assert task_names(batches_of(tmp_path, chunk=7)) == task_names(batches_of(tmp_path))


def test_plan_knows_the_files_and_the_disk_of_chunks(tmp_path, here):
    """By one task with a file of its own, and by tasks in files of several; 56 kB a task, or two."""
    keys = {"compress": None, "phi": [0.7], "n": 8}
    campaign = jamlab.open_campaign(written(tmp_path / "c.toml", seeds=33, chunk=16, **keys))
    (line,) = campaign.plan()
    assert (line.files, line.bytes, line.estimated) == (3, None, True)
    campaign.run(1, pilot=True)
    (line,) = campaign.plan()
    assert (line.left, line.files, line.estimated) == (32, 2, False)
    campaign.run(1)
    files = list((campaign.folder.path / "tasks").glob("chunk-*"))
    assert len(files) == line.files
    size = sum(file.stat().st_size for file in files)
    assert 0.5 * size < line.bytes < 2 * size and size < 32 * 2_000
    later = jamlab.open_campaign(written(tmp_path / "c.toml", seeds=65, chunk=16, **keys))
    (again,) = later.plan()
    assert (again.left, again.files) == (32, 2) and 0.8 * size < again.bytes < 2.5 * size
    alone = jamlab.open_campaign(written(tmp_path / "c.toml", seeds=65, **keys))
    assert alone.plan()[0].files == 32


def test_the_number_of_files_needs_the_time_of_a_task(tmp_path):
    (chosen,) = batches_of(tmp_path, seeds=10_000)
    assert chunks.count_chunks(chosen, 10_000, None, 8) is None
    for each, workers in ((0.2, 8), (30.0, 8)):
        cutter = Cutter([chosen], task_names([chosen]), lambda count=workers: count, {chosen.name: each})
        handed = []
        while (chunk := cutter.next()) is not None:
            handed.append(chunk)
            cutter.learn(chunk, each * len(chunk.seeds))
        assert chunks.count_chunks(chosen, 10_000, each, workers) == pytest.approx(len(handed), rel=0.1)
    (few,) = batches_of(tmp_path, seeds=999)
    assert chunks.count_chunks(few, 900, None, 8) == 900


def test_chunks_shares_and_resumes_make_the_same_packings(tmp_path, here):
    keys = {"compress": None, "phi": [0.7], "n": 8, "seeds": 11}
    alone = jamlab.open_campaign(written(tmp_path / "a.toml", name="a", **keys))
    assert alone.run(1).finished == 11
    for chunk, share in ((3, (1, 2)), (None, (2, 3)), (100, (1, 1))):
        parts = jamlab.open_campaign(written(tmp_path / "b.toml", name="b", chunk=chunk, **keys))
        left = 11 - parts.status().finished
        ran = parts.run(1, share=share)
        assert ran.finished + ran.left == left and ran.finished
    sizes = sorted(len(names_in_chunk(file)) for file in (parts.folder.path / "tasks").glob("chunk-*"))
    assert sizes == [3, 3, 3] and parts.status().finished == 11  # seeds 1 3 5, 7 9 11, then 2, 8; and 4 6 10
    assert_same(alone, parts, ("states",))


def test_the_start_of_lammps_is_no_part_of_the_time_of_a_task(tmp_path, here, monkeypatch):
    """Else `plan` would take the time of a million tasks from that of one that is several times as long."""
    monkeypatch.setattr("jamlab.campaign.workers.lammps_class", lambda: time.sleep(2.0))
    keys = {"compress": None, "phi": [0.7], "n": 8, "seeds": 1}
    told = []
    jamlab.open_campaign(written(tmp_path / "c.toml", **keys)).run(1, done=told.append)
    assert told[0].seconds < 1.9
