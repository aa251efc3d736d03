"""The one mechanism: tasks whose rows are kept, tables and their manifest, pages, groups and commands."""

import json
from functools import partial

import campaigns
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest
from commands import call_studies
from matplotlib.figure import Figure
from PIL import Image

import jamlab
from studies import pages, registry
from studies.panels import Drawing, TextTable
from studies.reference_data import open_tables
from studies.study import Group, Study
from studies.tables import DATA, MANIFEST, AbsentTableError, forget, measure, read_manifest, read_table
from studies.tables import write_table as write


def rows(seed, done):
    done.append(seed)
    if seed == 13:
        raise jamlab.InputError("thirteen")
    return [] if seed == 7 else [{"seed": seed, "error": 1.23456789e-9 * seed, "note": 'a, "b"\nc'}, {"seed": seed}]


def tasks(*seeds, done):
    return {f"{seed}, a": partial(rows, seed, done) for seed in seeds}


def test_a_run_that_stops_keeps_its_rows_and_resumes(tmp_path):
    """Also after a task without rows, whose other cells are empty and which no reader sees."""
    done, told = [], []
    with pytest.raises(jamlab.InputError):
        measure(tmp_path, "t", tasks(7, 1, 13, 2, done=done))
    assert read_table(tmp_path, "t")["seed"].tolist() == [1, 1]
    measure(tmp_path, "t", tasks(7, 1, 2, done=done), lambda share, text: told.append(share))
    assert done == [7, 1, 13, 2] and told == [pytest.approx(2 / 3)]
    table = read_table(tmp_path, "t")
    assert table["task"].tolist() == ["1, a", "1, a", "2, a", "2, a"]
    assert table["error"].isna().tolist() == [False, True] * 2
    assert table["error"][0] == 1.23457e-9 and table["note"].tolist() == ['a, "b" c', ""] * 2
    assert table["seed"].dtype == "int64"
    before = (tmp_path / "t.csv").read_bytes()
    measure(tmp_path, "t", tasks(7, 1, 2, done=done))
    assert (tmp_path / "t.csv").read_bytes() == before and len(done) == 4


def test_a_table_that_is_forgotten_is_measured_anew(tmp_path):
    done = []
    for name in ("t", "u"):
        measure(tmp_path, name, tasks(1, done=done))
    forget(tmp_path, "t")
    assert list(read_manifest(tmp_path)) == ["u.csv"] and not (tmp_path / "t.csv").exists()
    forget(tmp_path, "t")
    measure(tmp_path, "t", tasks(1, done=done))
    assert done == [1, 1, 1] and len(read_table(tmp_path, "t")) == 2


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_a_table_comes_back_as_it_was_and_a_changed_one_is_refused(tmp_path, kind):
    table = pd.DataFrame({"model": ["sp", "dp"], "n": [32, 64], "phi": [0.1 + 0.2, np.nan], "onset": [True, False]})
    path = write(tmp_path, "t", table, "abc def", kind=kind)
    pd.testing.assert_frame_equal(read_table(tmp_path, "t"), table, check_dtype=kind == "parquet")
    assert read_manifest(tmp_path)[path.name] | {"sha256": "", "date": ""} == {
        "rows": "2", "commit": "abc def", "sha256": "", "date": "",
    }  # fmt: skip
    path.write_bytes(path.read_bytes()[:-7])
    with pytest.raises(jamlab.StorageError) as refused:
        read_table(tmp_path, "t")
    assert str(path) in str(refused.value)
    with pytest.raises(AbsentTableError):
        read_table(tmp_path, "u")


def test_the_manifest_names_every_table_that_ships():
    known = read_manifest(DATA)
    assert {path.name for path in DATA.iterdir() if path.suffix in (".csv", ".parquet")} == {*known, MANIFEST}
    assert len({name.partition(".")[0] for name in known}) == len(known)  # a name is that of one table
    for name, entry in known.items():
        table = read_table(DATA, name.partition(".")[0])  # checks its hash
        assert len(table) == int(entry["rows"]) and entry["commit"] and entry["date"]


def test_every_study_has_a_name_of_its_own_a_title_and_a_table():
    groups, known = registry.GROUPS, registry.STUDIES
    assert sum(len(group.studies) for group in groups.values()) == len(known)
    assert all(study.title and name == study.name for name, study in known.items())
    assert {f"{name}.csv" for name, study in known.items() if study.tasks} <= set(read_manifest(DATA))


def drawing(name, tables):
    if name == "absent":
        raise jamlab.InputError("no data")
    table = TextTable(["x"], [["cell <&>"]], folded="1 row")
    return Drawing(name, Figure(), f"caption of {name}.", rows=[tables.read("t")], text=[table])


def test_a_page_holds_what_could_be_drawn_and_why_the_rest_could_not(tmp_path):
    measure(tmp_path / "results", "t", {"one": lambda: [{"x": 1.23456789}]})
    tables = open_tables(tmp_path / "results")
    studies = [Study(name, f"chart {name}", {}, partial(drawing, name)) for name in ("t", "a", "absent")]
    told = []
    drawn, failed = pages.write_page(
        tmp_path, "all", Group("Title", "A lead.", studies), tables,
        progress=lambda *step: told.append(step),
    )  # fmt: skip
    assert [each.name for each in drawn] == ["t", "a"] and failed == {"absent": "no data"}
    assert told == [(0.0, "t"), (1 / 3, "a"), (2 / 3, "absent")]
    files = {f"{name}.{kind}" for name in ("t", "a") for kind in ("png", "pdf", "csv")} | {"all.html"}
    assert {path.name for path in tmp_path.iterdir() if path.is_file()} == files
    page = (tmp_path / "all.html").read_text()
    assert page.index("caption of t. Measured") < page.index("caption of a") < page.index("no data")
    assert "cell &lt;&amp;&gt;" in page and "A lead." in page and "<details><summary>1 row</summary>" in page


def test_commands(tmp_path):
    listed = call_studies(tmp_path, "list").stdout
    assert all(name in listed for name in registry.STUDIES)
    done = call_studies(tmp_path, "draw", "baumgarten-5", "moved", "--out", "d", "--json")
    assert done.exit_code == 0, done.stderr
    assert set(json.loads(done.stdout)["captions"]) == {"baumgarten-5", "moved"}
    for words, named in (
        (("draw", "weather"), "weather"),
        (("run", "weather"), "weather"),
        (("run", "boromand-6"), "reference.toml"),
        (("draw", "moved", "--from", "nowhere"), "nowhere"),
        (("draw", "moved", "--from", "d", "--out", "d"), "d"),
    ):
        done = call_studies(tmp_path, *words)
        assert done.exit_code == 1 and named in done.stderr, words


def test_contact_sheets(tmp_path):
    """Twelve pictures each, in their order, reduced to one width; thumbnails are left out."""
    (tmp_path / "p" / "thumb").mkdir(parents=True)
    for k in range(13):
        Image.new("RGB", (1200, 300 * (1 + k % 2)), "red").save(tmp_path / "p" / f"{k:02}.png")
    Image.new("RGB", (9, 9)).save(tmp_path / "p" / "thumb" / "small.png")
    done = call_studies(tmp_path, "sheet", "p", "--out", "s")
    assert done.exit_code == 0, done.stderr
    sheets = [plt.imread(tmp_path / "s" / f"sheet-{k}.png") for k in (1, 2)]
    assert [sheet.shape[:2] for sheet in sheets] == [(4 * 318, 1800), (168, 1800)]
    assert call_studies(tmp_path, "sheet", "s/none").exit_code == 1


def test_results_of_ones_own_are_drawn_and_their_gaps_named(tmp_path, monkeypatch):
    squares = Study("t", "Squares", {"1": lambda: [{"x": 1}]}, partial(drawing, "t"))
    monkeypatch.setattr(registry, "STUDIES", {"t": squares, "moved": registry.STUDIES["moved"]})
    assert "task 1 of 1" in call_studies(tmp_path, "run", "t", "--out", "results").stderr
    done = call_studies(tmp_path, "draw", "t", "moved", "--from", "results", "--out", "d", "--json")
    said = json.loads(done.stdout)
    assert list(said["captions"]) == ["t"] and "moved" in said["not_drawn"]["moved"]
    assert list(pd.read_csv(tmp_path / "d" / "t.csv")) == ["task", "took", "x"]


def test_a_campaign_is_reduced(tmp_path):
    campaign = jamlab.open_campaign(campaigns.written(tmp_path / "c.toml", n=8, seeds=2, compress=None, onset=True))
    campaigns.run_here(campaign)
    done = call_studies(tmp_path, "reduce", campaign.file, "--only", "onset", "--out", "tables")
    assert done.exit_code == 0, done.stderr
    table = open_tables(tmp_path / "tables").read("onset")
    assert sorted(table["seed"]) == [1, 2] and np.isfinite(table["rho_J"]).all()


def test_no_file_is_replaced_unless_asked_for(tmp_path):
    (tmp_path / "c.toml").write_text(campaigns.FULL)
    for words, name in (("draw stability", "moved.png"), ("reduce c.toml", "states.parquet")):
        file = tmp_path / words / name
        file.parent.mkdir()
        file.write_text("work of a week")
        done = call_studies(tmp_path, *words.split(), "--out", file.parent)
        assert done.exit_code == 1 and name in done.stderr, done.stderr
        assert file.read_text() == "work of a week" and list(file.parent.glob("*")) == [file]
