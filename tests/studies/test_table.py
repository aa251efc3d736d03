"""Tables of measurements: what is saved, what an interrupted run goes on with, what is refused."""

import json

import numpy as np
import pytest

import jamlab
from studies.table import done_tasks, measure_table, read_table, shipped_table

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
    before = path.read_bytes()
    measure_table(path, COLUMNS, tasks(1, 2, 7, 3), {"n": (8, 16)})
    assert path.read_bytes() == before


@pytest.mark.parametrize("cut", ["\n", "nan,\n", "eed 2,{took},2,nan,\n", "seed 2,{took},2,nan,\n", "both"])
def test_a_task_that_was_cut_short_is_refused_and_done_again(tmp_path, cut):
    """Within a line, or at its end."""
    path, done = tmp_path / "t.csv", []
    measure_table(path, COLUMNS, tasks(7, 1, 2), {})
    first, rest = path.read_text(encoding="utf-8").split("\n", 1)
    lines = rest.splitlines(keepends=True)
    took = lines[-1].split(",")[1]
    cut = "".join(lines[-2:]) if cut == "both" else cut.format(took=took)
    assert rest.endswith(cut)
    path.write_text(f"{first}\n{rest.removesuffix(cut)}", encoding="utf-8")
    with pytest.raises(jamlab.StorageError, match=r"t\.csv was cut short and holds [01] of 2 rows of task 'seed 2'"):
        read_table(path)
    assert done_tasks(path) == {"seed 7", "seed 1"}
    found = measure_table(path, COLUMNS, tasks(7, 1, 2, done=done), {})
    assert done == [2] and found.rows["seed"].tolist() == [1, 1, 2, 2]
    assert found.tasks == {"seed 7", "seed 1", "seed 2"}
    assert path.read_text(encoding="utf-8").split("\n")[1:4] == rest.split("\n")[:3]


def written(path, first, body):
    path.write_text(f"# {json.dumps(first)}\n{body}", encoding="utf-8")
    return path


def provenance_of(path):
    return json.loads(path.read_text(encoding="utf-8").split("\n")[0].removeprefix("# "))


@pytest.mark.parametrize("end", ["", "\n"])
@pytest.mark.parametrize("piece", ["\n1", "\n16.6", "\n16.6,1"])
def test_a_piece_of_a_row_is_never_kept(tmp_path, piece, end):
    """Where it reads as a row of another task, or lacks its last cells."""
    path = tmp_path / "t.csv"
    named = dict(zip(("1", "16.6"), tasks(1, 2).values(), strict=True))
    measure_table(path, COLUMNS, named, {})
    text = path.read_text(encoding="utf-8")
    path.write_text(text[: text.rindex("\n16.6,")] + piece + end, encoding="utf-8")
    assert done_tasks(path) == {"1"}
    assert measure_table(path, COLUMNS, named, {}).rows["task"].value_counts().to_dict() == {"1": 2, "16.6": 2}
    assert read_table(path).rows["seed"].tolist() == [1, 1, 2, 2]


def test_notes_of_two_lines_are_read_and_gone_on_with(tmp_path):
    """As earlier versions wrote them, with and without how many rows there are."""
    path = tmp_path / "t.csv"
    measure_table(path, COLUMNS, tasks(1), {})
    first = provenance_of(path)
    body = 'task,took,seed,error,note\nseed 1,2,1,1,"a\nb"\nseed 1,2,1,2,"say ""c""\nd"\n'
    without = {key: value for key, value in first.items() if key != "rows"}
    for start in (first, without):
        assert read_table(written(path, start, body)).rows["note"].tolist() == ["a\nb", 'say "c"\nd']
    assert measure_table(path, COLUMNS, tasks(1, 2), {}).rows["note"].tolist()[:2] == ["a\nb", 'say "c"\nd']
    path.write_text(path.read_text(encoding="utf-8").rsplit('d"', 1)[0] + "d\n", encoding="utf-8")
    with pytest.raises(jamlab.StorageError, match="is no table of python -m studies run"):
        read_table(path)


def test_more_rows_than_recorded(tmp_path):
    path = tmp_path / "t.csv"
    measure_table(path, COLUMNS, tasks(1, 2), {})
    text = path.read_text(encoding="utf-8")
    last = text.splitlines(keepends=True)[-1]
    path.write_text(text + last, encoding="utf-8")
    with pytest.raises(jamlab.StorageError, match=r"t\.csv holds 3 rows of task 'seed 2', 2 expected: .*studies run"):
        read_table(path)
    done = []
    assert measure_table(path, COLUMNS, tasks(1, 2, done=done), {}).rows["seed"].tolist() == [1, 1, 2, 2]
    assert done == [2]
    path.write_text(text + last.replace("seed 2", "seed 3"), encoding="utf-8")
    for use in (read_table, done_tasks, lambda path: measure_table(path, COLUMNS, tasks(1, 2), {})):
        with pytest.raises(jamlab.StorageError, match="rows of task 'seed 3', which its first line does not name"):
            use(path)


@pytest.mark.parametrize("name", ["t.csv.gz", "t.csv.xz"])
def test_packed_tables_go_on_too_and_are_written_alike_every_time(tmp_path, name):
    told = []
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        path = tmp_path / folder / name
        measure_table(path, COLUMNS, {"seed 7": list}, {}, progress=lambda *step: told.append(step))
        first = path.read_bytes()
        assert first[:2] in (b"\x1f\x8b", b"\xfd7") and first == (tmp_path / "a" / name).read_bytes()
    found = measure_table(path, COLUMNS, tasks(7, 1, 2), {}, progress=lambda *step: told.append(step))
    assert found.rows["seed"].tolist() == [1, 1, 2, 2] and found.tasks == {"seed 7", "seed 1", "seed 2"}
    assert told == [(0.0, "seed 7")] * 2 + [(1 / 3, "seed 1"), (2 / 3, "seed 2")]
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(jamlab.StorageError, match=f"cannot read .*{name}"):
        read_table(path)


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
        shipped_table("weather")
