"""Workers of campaigns that are the process of the tests itself: to start one costs a second."""

import contextlib
from collections import deque

import pytest

from jamlab.campaign.workers import run_task


class Here(contextlib.nullcontext):
    def __init__(self, function, count):
        super().__init__(self)
        self.tasks = deque()

    def submit(self, name, arguments):
        self.tasks.append((name, arguments))

    def wait(self):
        name, arguments = self.tasks.popleft()
        return name, "result", run_task(*arguments)


@pytest.fixture
def here(monkeypatch):
    """Run tasks in this process."""
    monkeypatch.setattr("jamlab.campaign.workers.crew", Here)
