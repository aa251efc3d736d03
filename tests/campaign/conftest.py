"""Workers of campaigns that are the process of the tests itself: to start one costs a second."""

import contextlib
from collections import deque

import pytest

from jamlab.campaign.workers import Workers


class Here:
    width, cause = 1, "none"

    def __init__(self):
        self.calls = deque()

    def submit(self, key, call):
        self.calls.append((key, call))

    def wait(self):
        key, (function, *arguments) = self.calls.popleft()
        return key, function(*arguments)


@pytest.fixture
def here(monkeypatch):
    """Run tasks in this process."""
    monkeypatch.setattr(Workers, "crew", lambda workers: contextlib.nullcontext(Here()))


@pytest.fixture
def scheduler():
    from distributed import LocalCluster

    with LocalCluster(n_workers=0, processes=True, dashboard_address="127.0.0.1:0") as cluster:
        yield cluster.scheduler_address
