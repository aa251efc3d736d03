"""Tables come back from every format as they were, to the last bit."""

import csv
import json

import h5py
import numpy as np
import pandas as pd
import pytest
from pyarrow import parquet

from jamlab.errors import InputError
from jamlab.storage.formats import FORMATS
from jamlab.storage.table_file import TABLE_FORMATS, write_table

FRAME = pd.DataFrame(
    {
        "g": [1 / 3, -1e-300, np.nan, 0.1 + 0.2],
        "n": [2**53 + 1, 0, -1, 8],
        "converged": [True, False, True, True],
        "law": ["a", 'comma, "quote"', "δ and tab\t", ""],
    }
)


def read_text(path, separator):
    """Parsed by Python: older pandas miss the last digit."""
    with open(path, newline="", encoding="utf-8") as lines:
        rows = list(csv.DictReader(lines, delimiter=separator))
    texts = {name: [row[name] for row in rows] for name in FRAME}
    texts["converged"] = [text == "True" for text in texts["converged"]]
    return texts | {"g": [float(text or "nan") for text in texts["g"]], "n": list(map(int, texts["n"]))}


def read_json(path):
    rows = json.loads(path.read_text(encoding="utf-8"))
    return {name: [np.nan if row[name] is None else row[name] for row in rows] for name in FRAME}


def read_h5(path):
    with h5py.File(path) as file:
        return {name: (each.asstr() if each.dtype.kind == "O" else each)[()] for name, each in file.items()}


READERS = {
    "csv": lambda path: read_text(path, ","),
    "tsv": lambda path: read_text(path, "\t"),
    "json": read_json,
    "h5": read_h5,
    "parquet": lambda path: parquet.read_table(path).to_pandas(ignore_metadata=True),
}


@pytest.mark.parametrize("name", TABLE_FORMATS)
@pytest.mark.parametrize("rows", [len(FRAME), 0])
def test_a_table_comes_back(tmp_path, name, rows):
    write_table(FRAME[:rows].set_axis(np.arange(rows) ** 2), path := tmp_path / f"t.{name}")
    back = READERS[name](path)
    assert set(back) == set(FRAME)
    for column in FRAME:
        np.testing.assert_array_equal(list(back[column]), list(FRAME[column][:rows]))


def test_every_ending_has_a_writer():
    assert tuple(f".{name}" for name in TABLE_FORMATS) == FORMATS["tables"]


def test_what_json_cannot_say_is_null(tmp_path):
    write_table(pd.DataFrame({"g": [np.inf, -np.inf, np.nan, 1.0]}), tmp_path / "t.json")
    assert json.loads((tmp_path / "t.json").read_text()) == [{"g": None}] * 3 + [{"g": 1.0}]


def test_a_library_that_is_missing_is_named_with_the_remedy(tmp_path, monkeypatch):
    monkeypatch.setattr("jamlab.storage.table_file.find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"pyarrow.*jamlab\[parquet\]"):
        write_table(FRAME, tmp_path / "t.parquet")
    write_table(FRAME, tmp_path / "t.h5")
    assert [path.name for path in tmp_path.iterdir()] == ["t.h5"]


def test_an_ending_of_another_format_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"t\.xlsx.*\.parquet"):
        write_table(FRAME, tmp_path / "t.xlsx")
    assert not list(tmp_path.iterdir())
