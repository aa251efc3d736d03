"""What packings of 16 disks take in files of several tasks: bytes, time, memory.

    pytest -m benchmark -s tests/campaign/benchmark_chunk_files.py

takes three minutes.
"""

import json
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest
from campaigns import run_here, written
from chunk_files import KEYS, batch_of, stored

import jamlab
from jamlab.campaign.states import read_stored
from jamlab.campaign.tasks import batches
from jamlab.packing.hdf5 import image_of
from jamlab.storage.verified_file import add_names, label_of

pytestmark = pytest.mark.benchmark
LOOK = """
import json, resource, sys, time, warnings
import pandas
import jamlab
warnings.simplefilter("ignore")
campaign, found = jamlab.open_campaign(sys.argv[1]), {}
for name, look in (("finished", campaign.finished), ("status", campaign.status), (sys.argv[2], eval(sys.argv[2]))):
    before, began, wall = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time(), time.perf_counter()
    result = look()
    found[name] = {"cpu": time.process_time() - began, "wall": time.perf_counter() - wall}
    found[name]["count"] = getattr(result, "tasks", None) or len(result)
    found[name]["mb"] = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1e3
print(json.dumps(found))
"""


def looked(folder, what):
    """Seconds and memory, in a process of its own, of finished tasks, status, and something else."""
    done = subprocess.run([sys.executable, "-c", LOOK, folder, what], check=True, capture_output=True, text=True)
    found = json.loads(done.stdout)
    for name, row in found.items():
        print(f"{name:40s} {row['count']:8d}  {row['wall']:7.2f} s  {row['cpu']:7.2f} CPU s  {row['mb']:7.0f} MB more")
    return found


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """300 finished tasks, and the mean size of their files."""
    campaign, batch = batch_of(tmp_path_factory.mktemp("made") / "c.toml", 300)
    run_here(campaign)
    contents = [stored(campaign, task) for task in batch.tasks()]
    files = [campaign.folder.task_file(name) for name in batch.names()]
    print(f"\na file of its own: {np.mean([file.stat().st_size for file in files]) / 1e3:.1f} kB")
    return contents


def again(contents, batch, rng):
    """As many tasks as the batch has, with packings and numbers of the contents, whose last digits differ."""
    for k, task in enumerate(batch.tasks()):
        content = contents[k % len(contents)]
        (packing,) = content.states.packings
        history = {**packing.provenance, "seed": task.parameters.seed, "wall_time": rng.random()}
        minimum = {name: getattr(packing, name) for name in ("max_force", "converged", "tolerance", "on_rattlers")}
        places = packing.positions + 1e-9 * rng.random(packing.positions.shape)
        moved = packing._trusted(positions=places, provenance=history, **minimum)
        measured = {name: values * (1 + 1e-9 * rng.random()) for name, values in content.measured.items()}
        states = replace(content.states, packings=[moved])
        yield replace(content, task=task, states=states, measured=measured, seconds=rng.random())


@pytest.mark.parametrize("count", [2, 10, 100, 300])
def test_bytes_and_time_to_write(made, tmp_path, count):
    campaign, _ = batch_of(tmp_path / "c.toml", count)
    began, wall = time.process_time(), time.perf_counter()
    (path,) = campaign.folder.keep(made[:count])
    cpu, wall = (time.process_time() - began) / count, (time.perf_counter() - wall) / count
    size = path.stat().st_size / count
    print(f"\n{count} in a file: {size / 1e3:.2f} kB, {1e3 * cpu:.2f} CPU ms, {1e3 * wall:.2f} ms a packing")
    assert count < 10 or (size < 6e3 and cpu < 5e-3)


def test_a_table_of_1e5_packings(made, tmp_path):
    campaign, batch = batch_of(tmp_path / "c.toml", 100_000)
    campaign.folder.keep_copy(campaign.text, campaign.name)
    rng, contents = np.random.default_rng(1), []
    for content in again(made, batch, rng):
        contents.append(content)
        if len(contents) == 1000:
            campaign.folder.keep(contents)
            contents = []
    print(f"\n{sum(p.stat().st_size for p in (campaign.folder.path / 'tasks').iterdir()) / 1e5 / 1e3:.2f} kB a packing")
    found = looked(campaign.folder.path, "lambda: campaign.table('states')")
    assert found.popitem()[1]["wall"] < 60
    looked(campaign.folder.path, "lambda: [campaign.folder.damages(campaign.finished())]")
    looked(campaign.folder.path, "lambda: campaign.folder.gaps(campaign.finished()) or [0]")
    looked(campaign.folder.path, f"lambda: campaign.export({str(tmp_path / 'tables')!r}, ['states'])")
    looked(campaign.folder.path, "lambda: [campaign.packings(name) for name in campaign.finished()[:1000]]")


def test_names_and_status_of_1e6_tasks(tmp_path):
    """Only the start of each file is read."""
    campaign, batch = batch_of(tmp_path / "c.toml", 1_000_000)
    campaign.folder.keep_copy(campaign.text, campaign.name)
    names, image = list(batch.names()), image_of(lambda file: None)
    for k in range(0, len(names), 1000):
        some = names[k : k + 1000]
        path = campaign.folder.path / "tasks" / f"{label_of(some).replace(' ', '-')}.h5"
        path.write_bytes(add_names(image, some))
    found = looked(campaign.folder.path, "lambda: campaign.folder.finished()")
    assert found["status"]["count"] == 1_000_000 and found["status"]["wall"] < 60


def test_packings_stored_in_a_file_of_several(made, tmp_path):
    """What it takes to find the packings of a task in a file of several, beyond measuring them."""
    campaign, batch = batch_of(tmp_path / "c.toml", 300)
    campaign.folder.keep(made)
    path = written(tmp_path / "d.toml", **KEYS, seeds=300, observables=["order"])
    (more,) = batches(jamlab.open_campaign(path).content)
    began = time.process_time()
    for task, name in zip(more.tasks(), batch.names(), strict=True):
        assert read_stored(campaign.folder, [name], task.parameters)
    print(f"\n{1e3 * (time.process_time() - began) / 300:.2f} CPU ms a packing to read it")
