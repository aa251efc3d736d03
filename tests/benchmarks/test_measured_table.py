"""Tables of measurements: what is saved, what an interrupted run goes on with, what is refused."""

import json

import numpy as np
import pytest

import jamlab
from jamlab.benchmarks.measured_table import done_tasks, measure_table, read_table, shipped_table

COLUMNS = ["seed", "error", "note"]


def tasks(*seeds, done=None):
    def task(seed):
        def run():
            if done is not None:
                done.append(seed)
            if seed == 7:
                return []
            if seed == 13:
                raise jamlab.InputError("thirteen")
            return [{"seed": seed, "error": 1.23456789e-9 * seed, "note": 'a, "b"'}, {"seed": seed, "error": np.nan}]

        return run

    return {f"seed {seed}": task(seed) for seed in seeds}


def test_a_run_that_breaks_off_goes_on_where_it_stopped(tmp_path):
    path, done = tmp_path / "t.csv", []
    with pytest.raises(jamlab.InputError, match="thirteen"):
        measure_table(path, COLUMNS, tasks(1, 2, 7, 13, 3, done=done), {"n": (8, 16)})
    assert done_tasks(path) == {"seed 1", "seed 2", "seed 7"}
    found = measure_table(path, COLUMNS, tasks(1, 2, 7, 3, done=done), {"n": (8, 16)})
    assert done == [1, 2, 7, 13, 3]
    assert found.rows["seed"].tolist() == [1, 1, 2, 2, 3, 3]
    assert found.rows["error"].isna().tolist() == [False, True] * 3
    assert found.rows["error"][0] == 1.23457e-9 and found.rows["note"][0] == 'a, "b"'
    assert found.provenance["facts"] == {"n": [8, 16]} and "numpy" in found.made
    assert sum(session["tasks"] for session in found.provenance["sessions"]) == 4
    assert found.seconds == pytest.approx(found.rows["took"][::2].sum())
    before = path.read_bytes()
    measure_table(path, COLUMNS, tasks(1, 2, 7, 3), {"n": (8, 16)})
    assert path.read_bytes() == before


def test_other_measurements_are_not_gone_on_with(tmp_path):
    path = tmp_path / "t.csv"
    measure_table(path, COLUMNS, tasks(1), {"n": 8})
    for columns, facts in ((COLUMNS, {"n": 9}), (COLUMNS[:2], {"n": 8})):
        with pytest.raises(jamlab.StorageError, match="another measurement"):
            measure_table(path, columns, tasks(1), facts)
    with pytest.raises(ValueError, match="error"):
        measure_table(tmp_path / "u.csv", ["seed", "note"], tasks(1), {})
    with pytest.raises(jamlab.StorageError, match="no folder"):
        measure_table(tmp_path / "missing" / "t.csv", COLUMNS, tasks(1), {})


@pytest.mark.parametrize("text", ["", "a,b\n1,2\n", "# {}\na\n1\n", '# {"schema": "x", "version": 1}\na\n1\n'])
def test_files_that_are_no_tables(tmp_path, text):
    path = tmp_path / "t.csv"
    path.write_text(text)
    with pytest.raises(jamlab.StorageError, match=r"t\.csv"):
        read_table(path)
    newer = json.dumps({"schema": "jamlab-measured", "version": 2})
    path.write_text(f"# {newer}\na\n1\n")
    with pytest.raises(jamlab.StorageError, match="2 is not known"):
        read_table(path)
    with pytest.raises(jamlab.StorageError, match="ships no table 'weather'"):
        shipped_table("jamlab.benchmarks.speed_accuracy", "weather")
