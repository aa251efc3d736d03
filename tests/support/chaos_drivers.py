"""Run a campaign on an executor of the ecosystem, as a user's script: `python chaos_drivers.py loky c.toml`."""

import json
import sys
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from tempfile import TemporaryDirectory

import jamlab


@contextmanager
def dask():
    """Two workers of Dask on this machine."""
    import dask.config
    from distributed import Client, LocalCluster

    dask.config.set({"distributed.deploy.lost-worker-timeout": "1h"})  # else workers that die often are not replaced
    how = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    with (
        TemporaryDirectory() as folder,
        dask.config.set({"temporary-directory": folder}),
        LocalCluster(**how, local_directory=folder) as cluster,
        Client(cluster) as client,
    ):
        yield client.get_executor(pure=False)


@contextmanager
def loky():
    """Two processes of loky."""
    from loky import get_reusable_executor

    executor = get_reusable_executor(max_workers=2)
    yield executor
    executor.shutdown(kill_workers=True)


def processes():
    """Two processes of the standard library."""
    return ProcessPoolExecutor(2)


ENGINES = {"dask": dask, "loky": loky, "processes": processes}

if __name__ == "__main__":
    with ENGINES[sys.argv[1]]() as executor:
        ran = jamlab.open_campaign(sys.argv[2]).run(executor)
    print(json.dumps(vars(ran)))
    sys.exit(1 if ran.failed else 0)  # as the command does
