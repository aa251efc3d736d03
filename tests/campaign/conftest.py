"""Workers of campaigns that are the process of the tests itself: to start one costs a second."""

from concurrent.futures import Executor, Future

import pytest

from jamlab.processes.executor import OnExecutor


class InThisProcess(Executor):
    _max_workers = 1

    def submit(self, function, /, *arguments):
        future = Future()
        future.set_result(function(*arguments))
        return future


@pytest.fixture
def here(monkeypatch):
    """Run tasks in this process."""
    monkeypatch.setattr("jamlab.campaign.driver.crew", lambda function, where: OnExecutor(function, InThisProcess()))
