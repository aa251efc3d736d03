"""A campaign on jobs that are shorter than it, on a batch system of this machine."""

import pytest
from chaos import Place, content_of, engine, gone, serial, short_root, start, unequal

COUNT = 10


@pytest.fixture
def place():
    """Ten tasks of three seconds."""
    with short_root() as root:
        yield Place(root, COUNT, poison=-1, short=3.0, long=3.0)


@pytest.mark.slow
def test_tasks_go_on_in_the_next_job(place, tmp_path):
    """One job at a time, of twenty seconds; nothing is lost or left, and the packings are those of a serial run."""
    with engine("slurm", place, slots=1, walltime="00:00:20") as (words, environment):
        process, said = start(words, environment, place)
        assert process.wait(400) == 0, said()
        assert gone(lambda: not place.processes(), 30) is not None
        assert gone(lambda: len(place.batch.log("ended") + place.batch.log("cancelled")) >= 2, 5) is not None
        assert place.batch.log("walltime")
    expected, _ = serial(tmp_path, COUNT)
    status = place.campaign.status()
    assert (status.finished, status.failed, status.left) == (COUNT, 0, 0)
    assert unequal(content_of(place.campaign), expected) == (0, "")
    assert not place.strangers() and not place.marks()
