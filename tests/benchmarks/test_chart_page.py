"""The page of charts: what is written, and what is left when a chart breaks off."""

import numpy as np
import pandas as pd
import pytest
from jamlab.studies.chart_page import Chart, write_charts
from matplotlib.figure import Figure

from jamlab.figures.html_page import TextTable


def draw(name):
    if name == "broken":
        raise RuntimeError("broken off")
    rows = [{"chart": name, "error": 1.23456789e-12, "note": "a, b"}, {"chart": name, "error": np.nan, "note": ""}]
    return Chart(f"chart {name}", f"caption of {name}", Figure(), TextTable(["x"], [["cell <&>"]]), rows)


def test_charts_are_written_in_their_order(tmp_path):
    told = []
    write_charts(tmp_path / "new", "all", "Title", "Lead.", draw, ["b", "a"], {"data": "quick"}, progress=told.append)
    assert told == ["b", "a"]
    assert {path.name for path in (tmp_path / "new").iterdir()} == {"all.csv", "all.html", "a.png", "b.png"}
    table = pd.read_csv(tmp_path / "new" / "all.csv")
    assert table["chart"].tolist() == ["b", "b", "a", "a"]
    assert table["error"].isna().tolist() == [False, True, False, True] and table["error"][0] == 1.2345679e-12
    page = (tmp_path / "new" / "all.html").read_text()
    assert page.index("caption of b") < page.index("caption of a")
    assert "cell &lt;&amp;&gt;" in page and "quick" in page and "jamlab" in page


def test_a_run_that_breaks_off_leaves_what_it_drew(tmp_path):
    with pytest.raises(RuntimeError, match="broken off"):
        write_charts(tmp_path, "all", "Title", "Lead.", draw, ["a", "broken", "b"], {})
    assert pd.read_csv(tmp_path / "all.csv")["chart"].unique().tolist() == ["a"]
    assert not (tmp_path / "all.html").exists() and not (tmp_path / "b.png").exists()
