"""The page of studies: what is written, and what is left when a study breaks off."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

import jamlab
from studies.html_page import TextTable
from studies.study import Page, Shown, write_page

PAGE = Page("all", "Title", lambda claims: "Lead.")


def draw(name):
    if name == "broken":
        raise RuntimeError("broken off")
    if name == "absent":
        raise jamlab.InputError("no data")
    rows = [{"chart": name, "error": 1.23456789e-12, "note": "a, b"}, {"chart": name, "error": np.nan, "note": ""}]
    table = TextTable(["x"], [["cell <&>"]], folded="1 row")
    return Shown(Figure(), f"caption of {name}", [table], pd.DataFrame(rows))


def write(folder, *names, page=PAGE, **how):
    return write_page(folder, page, {name: f"chart {name}" for name in names}, draw, {"data": "quick"}, **how)


def test_studies_are_written_in_their_order(tmp_path):
    told = []
    _, failures = write(tmp_path / "new", "b", "a", "absent", progress=lambda *step: told.append(step))
    assert told == [(0.0, "b"), (1 / 3, "a"), (2 / 3, "absent")]
    assert {path.name for path in (tmp_path / "new").iterdir()} == {"all.csv", "all.html", "a.png", "b.png"}
    table = pd.read_csv(tmp_path / "new" / "all.csv")
    assert table["chart"].tolist() == ["b", "b", "a", "a"]
    assert table["error"].isna().tolist() == [False, True, False, True] and table["error"][0] == 1.2345679e-12
    page = (tmp_path / "new" / "all.html").read_text()
    assert page.index("caption of b") < page.index("caption of a") < page.rindex("Not drawn") < page.index("no data")
    assert "cell &lt;&amp;&gt;" in page and "quick" in page and "jamlab" in page
    assert "<details><summary>1 row</summary>" in page
    assert [(f.name, f.reason) for f in failures] == [("absent", "no data")]


def test_each_study_can_have_its_own_files(tmp_path):
    write(tmp_path, "a", page=Page("all", "Title", lambda claims: "Lead.", each=True))
    assert {path.name for path in tmp_path.iterdir()} == {"all.html", "a.png", "a.pdf", "a.csv"}


def test_a_run_that_breaks_off_leaves_what_it_drew(tmp_path):
    with pytest.raises(RuntimeError, match="broken off"):
        write(tmp_path, "a", "broken", "b")
    assert pd.read_csv(tmp_path / "all.csv")["chart"].unique().tolist() == ["a"]
    assert not (tmp_path / "all.html").exists() and not (tmp_path / "b.png").exists()
    with pytest.raises(jamlab.InputError, match="no study could be drawn; absent: no data"):
        write(tmp_path, "absent")
