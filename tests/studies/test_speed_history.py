"""Records of speed: what is told of made-up ones, and what is written of a measured one."""

import json
import sys
from dataclasses import replace

import numpy as np
import pytest
from commands import call_studies

from studies.speed_history.losses import changes, level
from studies.speed_history.record import Record, read_records, write_record

PROCESSES, REPEATS, NOISE = 3, 5, 0.01


def made_up(commit, day, times, seed, noise=NOISE, found=0.84):
    """A record of works by name; times over plain work that scatter from process to process and from run to run."""
    rng = np.random.default_rng(seed)

    def ratios(time):
        of_process = rng.normal(1, noise, PROCESSES)
        return [list(time * each * rng.normal(1, noise, REPEATS)) for each in of_process]

    rows = {
        name: {"ratios": ratios(time), "seconds": [time] * PROCESSES, "found": [found]} for name, time in times.items()
    }
    return Record(commit, f"2026-01-{day:02d}T00:00:00+00:00", f"2026-01-{day:02d}", "a machine", "3.13", "2", rows)


@pytest.mark.parametrize("loss, told", [(1.0, False), (1.1, True), (0.9, False), (1.3, True)])
def test_a_loss_of_a_tenth_is_told_and_none_is_not(loss, told):
    """Twenty pairs of records whose times scatter by one per cent: all that lost are told, and no other."""
    for seed in range(20):
        before, after = made_up("a", 1, {"w": 5.0}, seed), made_up("b", 2, {"w": 5.0 * loss}, 100 + seed)
        (change,) = changes(after, [before, after])
        assert change.lost == told, (seed, change)


def test_a_slow_loss_is_told_against_the_best_record():
    """Each step loses too little to be told against the last record, all of them enough against the first one."""
    records = [made_up(f"c{k}", 1 + k, {"w": 1.04**k}, k, noise=1e-4) for k in range(4)]
    last, best = changes(records[-1], records)
    assert (last.against, last.lost, best.against, best.lost) == ("c2", False, "c0", True)


def test_what_scatters_too_much_is_not_known():
    rough = [made_up("a", 1, {"w": 1.0}, 1, noise=0.1), made_up("b", 2, {"w": 1.0}, 2, noise=0.1)]
    (change,) = changes(rough[1], rough)
    assert change.unsure and not change.lost and change.cells[2] == "not known to 10%"


def test_later_commits_and_absent_works_are_left_out():
    first, second = made_up("a", 1, {"w": 1.0}, 1), made_up("b", 2, {"w": 2.0, "new": 1.0}, 2, found=0.85)
    assert changes(first, [first, second]) == []
    (change,) = changes(second, [second, first])
    assert change.work == "w" and change.another_result and change.cells[2] == "LOST, another result"


def test_another_machine_changes_nothing():
    """A machine of half the speed doubles seconds, and no ratio."""
    here = made_up("a", 1, {"w": 1.0}, 1)
    there = replace(here, commit="b", committed="2026-01-02T00:00:00+00:00")
    there.works["w"]["seconds"] = [2.0] * PROCESSES
    (change,) = changes(there, [here])
    assert change.ratio == 1.0


def test_error_of_one_process_is_that_of_its_repeats():
    assert level([[1.0, 1.0, 1.0, 2.0, 2.0]]) == (1.0, 0.5)
    assert level([[1.0], [2.0], [4.0]]) == (2.0, 0.75)


def test_the_command_ends_with_one_where_work_was_lost(tmp_path):
    for record in (made_up("a", 1, {"w": 1.0}, 1), made_up("b", 2, {"w": 1.2}, 2), made_up("c", 3, {"w": 1.0}, 3)):
        write_record(record, tmp_path)
    assert [record.commit for record in read_records(tmp_path)] == ["a", "b", "c"]
    ends = {name: call_studies(tmp_path, "speed", "--stored", name, "--out", ".") for name in "abc"}
    assert [ends[name].exit_code for name in "abc"] == [0, 1, 0]
    assert "LOST" in ends["b"].stdout and "LOST" not in ends["c"].stdout


def test_measured_work_is_compared_without_a_record(tmp_path):
    """Two works in one process; a record of an earlier commit, which took no time, tells that they are slower."""
    names = ["true packing fraction, 64 droplets", "measure, 64 disks"]
    write_record(made_up("a", 1, dict.fromkeys(names, 1e-3), 1), tmp_path)
    words = ["speed", "--out", ".", "--json", "--processes", "1", "--only", names[0], "--only", names[1]]
    done = call_studies(tmp_path, *words)
    found = json.loads(done.stdout)["changes"]
    assert done.exit_code == 1 and [one["work"] for one in found] == names and all(one["lost"] for one in found)
    assert [path.name for path in tmp_path.iterdir()] == ["a.json"]


def test_a_python_without_jamlab_is_named(tmp_path):
    program = tmp_path / "python"
    program.write_text(f"#!{sys.executable}\nimport sys\nsys.exit('No module named jamlab')\n")
    program.chmod(0o755)
    done = call_studies(tmp_path, "speed", "--out", ".", "--python", str(program))
    assert done.exit_code == 1 and "cannot run works.py: No module named jamlab" in done.stderr
