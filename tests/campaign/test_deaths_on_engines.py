"""Real workers that are killed, on own processes and on executors of others: see also benchmark_chaos.py."""

import signal
from contextlib import contextmanager

import pytest
from campaigns import assert_same, run_here, written

import jamlab
from jamlab.campaign.deaths import counts
from jamlab.campaign.marks import read_marks

pytestmark = pytest.mark.slow
POISON = 3
OWN = """
import os, time

def die(packing):
    if packing.provenance["seed"] == {poison}:
        os.kill(os.getpid(), {number})
    time.sleep({pause})
    return float(packing.provenance["seed"])
"""


@contextmanager
def pool():
    yield 2


@contextmanager
def dask(**settings):
    import dask
    from distributed import Client, LocalCluster

    with (
        dask.config.set({"distributed.deploy.lost-worker-timeout": "1h"} | settings),
        LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        Client(cluster) as client,
    ):
        yield client.get_executor(pure=False)


@contextmanager
def dask_that_retries():
    """A running scheduler as its users have it: it begins a call up to four times."""
    with dask() as executor:
        yield executor


@contextmanager
def dask_that_tells():
    with dask(**{"distributed.scheduler.allowed-failures": 0}) as executor:
        yield executor


@contextmanager
def loky():
    from loky import get_reusable_executor

    executor = get_reusable_executor(max_workers=2)
    yield executor
    executor.shutdown(kill_workers=True)


def campaign_of(folder, count, chunk, poison=POISON, number=signal.SIGKILL, pause=0.05):
    folder.mkdir()
    (folder / "deadly.py").write_text(OWN.format(poison=poison, number=int(number), pause=pause))
    keys = {"n": 8, "seeds": count, "compress": None, "onset": True, "chunk": chunk, "observables": ["deadly:die"]}
    return jamlab.open_campaign(written(folder / "c.toml", **keys))


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSEGV], ids=lambda number: number.name)
@pytest.mark.parametrize("chunk", [1, 6])
@pytest.mark.parametrize("engine", [pool, dask_that_retries, dask_that_tells, loky])
@pytest.mark.filterwarnings("ignore")
def test_one_task_ends_its_workers(tmp_path, engine, chunk, number):
    """All others finish, to the bits of an undisturbed run."""
    quiet = campaign_of(tmp_path / "quiet", 12, 1, poison=-1, pause=0.0)
    run_here(quiet)
    campaign = campaign_of(tmp_path / "deadly", 12, chunk, number=number)
    with engine() as executor:
        ran = campaign.run(executor)
    assert (ran.finished, ran.failed, ran.left) == (11, 1, 0)
    ((name, record),) = campaign.folder.failures().items()
    assert record["label"] == f"sp n=8 seed={POISON}" and 6 <= counts(campaign.folder.path)[name]["death"] <= 9
    assert number == signal.SIGKILL or "deadly.py" in record["reason"]
    assert not read_marks(campaign.folder.path) and not list(campaign.folder.path.rglob(".jamlab-*"))
    quiet.folder.task_file(name).unlink()
    assert_same(campaign, quiet, ["states"])
