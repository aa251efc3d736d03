"""Run a worker process on this machine: `python -m jamlab.campaign.worker_process SCHEDULER DRIVER_PID CORES`.

It asks the kernel to kill it when the driver dies (PR_SET_PDEATHSIG), so that no orphan goes on computing, whatever
killed the driver and whatever this process is doing.
"""

import asyncio
import sys

from jamlab.processes.child import die_with

DEATH_TIMEOUT = 60  # s without a scheduler after which a worker exits; as long as a connection may take, see workers.py
_LOOPBACK = "127.0.0.1"


async def _serve(scheduler: str, cores: int) -> None:
    from distributed import Worker

    # Dask would listen on every interface; this worker and its scheduler share one machine
    options = {"host": _LOOPBACK, "dashboard_address": f"{_LOOPBACK}:0", "dashboard": False}
    options["resources"] = {"cores": cores}
    async with Worker(scheduler, nthreads=1, memory_limit=0, death_timeout=DEATH_TIMEOUT, **options) as worker:
        await worker.finished()


if __name__ == "__main__":
    die_with(int(sys.argv[2]))
    asyncio.run(_serve(sys.argv[1], int(sys.argv[3])))
