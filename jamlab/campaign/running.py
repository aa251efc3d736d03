"""A run of a campaign in the background, for notebooks: `await` it, look at it, or stop it.

The driver runs in a thread of this process; tasks run in workers. What ends the process, or interrupts the cell that
awaits the run, ends the run as Ctrl-C does in a shell: what is finished stays, and the next run resumes.
"""

import atexit
import html
import threading
from collections.abc import Callable, Generator
from concurrent.futures import Future
from typing import Any

from jamlab.campaign.standing import CampaignRun, Meter, Standing
from jamlab.checks import checked

_LOOK = 0.1  # s: the loop of ipykernel 7 hears of an interrupt when it wakes for something else
_END = 10.0  # s that a run has to end before this process ends


class Running:
    r"""A run of a campaign in the background. Made by `Campaign.start`.

    Example:
        >>> from pathlib import Path
        >>> sweep = '[[sweep]]\nname = "disks"\nmodel = "sp"\nn = 8\nseeds = 2\nonset = true\n'
        >>> _ = Path("back.toml").write_text(f'name = "back"\n{sweep}')
        >>> running = jamlab.open_campaign("back.toml").start(workers=1)
        >>> running.wait().finished
        2
        >>> running.status().tasks, running.status().failed
        (2, 0)
    """

    def __init__(self, name: str, run: Callable[[Meter], CampaignRun]) -> None:
        self.name = name
        self._meter = Meter()
        self._future: Future[CampaignRun] = Future()
        self._future.set_running_or_notify_cancel()  # a caller that is cancelled leaves the result to others
        # a daemon: a process that ends does not wait for the run, but ends it
        self._thread = threading.Thread(target=self._run, args=(run,), name=f"campaign {name}", daemon=True)
        atexit.register(self._end)
        self._thread.start()

    def _run(self, run: Callable[[Meter], CampaignRun]) -> None:
        try:
            result = run(self._meter)
        except BaseException as error:  # whatever it is, it is raised where the run is awaited
            self._future.set_exception(error)
        else:
            self._future.set_result(result)
        finally:
            atexit.unregister(self._end)

    def _end(self) -> None:
        self._meter.interrupt()
        self._thread.join(_END)

    def __await__(self) -> Generator[Any, None, CampaignRun]:
        return self._awaited().__await__()

    async def _awaited(self) -> CampaignRun:
        import asyncio  # 30 ms, for notebooks alone

        try:
            while not self._future.done():
                await asyncio.sleep(_LOOK)
            return self._future.result()
        except asyncio.CancelledError:  # such as by the interrupt of a notebook
            self._meter.interrupt()
            await asyncio.to_thread(self._thread.join)
            raise

    @checked
    def wait(self, timeout: float | None = None) -> CampaignRun:
        """Wait until the run has ended; Ctrl-C, or the interrupt of a notebook, stops it.

        Args:
            timeout: longest time to wait, s; by default without limit.

        Returns:
            What the run did; of a run that was stopped, what it did until then.

        Raises:
            TimeoutError: the run has not ended in this time; it goes on.
            JamlabError: the run failed, see `Campaign.run`.
        """
        try:
            return self._future.result(timeout)
        except KeyboardInterrupt:
            self.stop()
            raise

    @checked
    def stop(self) -> Standing:
        """Stop the run and wait for its end; tasks under way are lost, and the next run resumes.

        Returns:
            How far it is.
        """
        self._meter.interrupt()
        self._thread.join()
        return self.status()

    @property
    def done(self) -> bool:
        """Whether the run has ended: finished, failed or stopped."""
        return self._future.done()

    @checked
    def status(self) -> Standing:
        """Say how far the run is: tasks finished and failed, rate, time left, workers."""
        return self._meter.standing()

    def __repr__(self) -> str:
        standing = self.status()
        if not self.done:
            return f"campaign {self.name}, {f'running: {standing}' if standing.tasks else 'starting'}"
        if (error := self._future.exception()) is not None:
            return f"campaign {self.name}, failed: {type(error).__name__}: {error}"
        return f"campaign {self.name}, {'stopped' if self._meter.stopped else 'finished'}: {standing}"

    def _repr_html_(self) -> str:
        bar = f'<progress max="1" value="{self.status().share:.4f}"></progress>'
        return f"<div>{bar} {html.escape(repr(self))}</div>"
