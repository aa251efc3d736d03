"""Studies by name: what ships; they are planned, run and drawn."""

import json
from dataclasses import dataclass
from functools import partial

import campaigns
import pytest
from commands import call, call_studies
from matplotlib.figure import Figure

import jamlab
from studies import gallery, registry
from studies.reference_data import read_record, save_reference
from studies.registry import CHARTS, MAPS, studies
from studies.study import Shown, TableStudy


def square(n):
    return [{"n": n, "square": n**2}]


@dataclass(frozen=True)
class Squares(TableStudy):
    columns = ("n", "square")

    def tasks(self):
        return {f"{n}": partial(square, n) for n in (1, 2, 3)}

    def show(self, table):
        figure = Figure()
        figure.subplots().plot(table.rows["n"], table.rows["square"])
        return Shown(figure, "Squares of numbers.", rows=table.rows)


def test_a_study_is_listed_planned_run_and_drawn_and_no_code_of_the_folder_runs(tmp_path, monkeypatch):
    (tmp_path / "jamlab-studies.txt").write_text("mine.py\n")
    (tmp_path / "mine.py").write_text("1 / 0\n")
    monkeypatch.setitem(registry.OTHERS, "squares", Squares("squares", "Squares of a few numbers"))
    found = json.loads(call_studies(tmp_path, "list", "--kind", "study", "--json").stdout)
    assert found["squares"] == {"kind": "study", "title": "Squares of a few numbers"}
    plan = ("run", "--plan", "squares", "--out", "results", "--json")
    assert json.loads(call_studies(tmp_path, *plan).stdout)["plan"] == [["squares", "3", "unknown"]]
    assert "squares: task 2 of 3" in call_studies(tmp_path, "run", "squares", "--out", "results").stderr
    assert json.loads(call_studies(tmp_path, *plan).stdout) == {"plan": [["squares", "0", "0"]], "seconds": 0.0}
    done = call_studies(tmp_path, "draw", "squares", "--from", "results", "--out", "drawn", "--json")
    assert json.loads(done.stdout)["captions"] == {"squares": "Squares of numbers."}
    assert {p.name for p in (tmp_path / "drawn").iterdir()} == {f"squares.{e}" for e in ("png", "pdf", "csv")} | {
        "studies.html"
    }
    refused = call_studies(tmp_path, "draw", "squares", "--from", "results", "--out", "results")
    assert refused.exit_code == 1 and "must not lie among results" in refused.stderr
    refused = call_studies(tmp_path, "draw", "squares", "--out", "other")
    assert refused.exit_code == 1 and "ships no table 'squares'" in refused.stderr


def test_all_that_ships_is_one_list(tmp_path):
    known = studies()
    assert {
        *CHARTS,
        *MAPS,
        *gallery.FIGURES,
        "comparison",
        "size-scaling",
        "droplet-calibration",
        "polydispersity",
        *("beyond-moduli", "beyond-forces-and-gaps", "beyond-protocols"),
        *("beyond-droplet-crystal", "beyond-droplet-foam"),
    } == set(known)
    assert all(study.title and name == study.name for name, study in known.items())
    done = call_studies(tmp_path, "run", "--plan", "weather")
    assert done.exit_code == 1 and "weather" in done.stderr and "boromand-6" in done.stderr


def test_a_figure_is_planned_by_its_campaign_and_drawn_from_what_ships(tmp_path):
    plan = studies()["dynamics-collapse"].plan(tmp_path)
    assert plan.left > 100 and plan.seconds is None  # no task is finished there
    errors = studies()["micrograph-errors"]  # of rendered pictures, not of a campaign
    errors.run(tmp_path / "none")
    assert errors.plan(tmp_path).left == 0 and not (tmp_path / "none").exists()
    assert studies()["size-scaling"].plan(tmp_path).seconds is None  # the table that ships lacks the largest sizes
    done = call_studies(tmp_path, "draw", "baumgarten-5", "moved", "--out", "d")
    assert done.exit_code == 0, done.stderr
    assert (tmp_path / "d" / "baumgarten-5.csv").exists() and (tmp_path / "d" / "moved.png").exists()
    with pytest.raises(jamlab.InputError, match="give the folder"):
        studies()["droplet-calibration"].draw()


def test_packings_of_a_campaign_are_added_to_tables(tmp_path, monkeypatch):
    campaign = jamlab.open_campaign(campaigns.written(tmp_path / "c.toml", n=8, seeds=1, compress=None, onset=True))
    campaigns.run_here(campaign)
    for commit in ("one", "two"):
        words = ("--add", "--out", "tables", "--commit", commit)
        done = call_studies(tmp_path, "reduce", campaign.file, *words)
        assert done.exit_code == 0, done.stderr
    record = read_record(tmp_path / "tables")
    assert [run["commit"] for run in record["runs"]] == ["one", "two"]
    assert record["runs"][0]["rows"] == record["runs"][1]["rows"]
    monkeypatch.setattr("jamlab.geometry.contact_network.CONTACTS_DEFINITION", 9)
    campaigns.run_here(campaign)
    with pytest.warns(UserWarning) as said:
        save_reference(campaign.file, tmp_path / "tables", "three", add=True)
    assert any(str(tmp_path / "tables") in str(w.message) and "contacts" in str(w.message) for w in said)


@pytest.mark.parametrize(
    ("words", "names"),
    [
        ("draw boromand-6", ["boromand-6.png", "boromand-6.pdf", "boromand-6.csv"]),
        ("draw papers", ["tables.csv", "figures.html", "verdicts.csv", "summary.txt"]),
        ("draw boromand-6 moved", ["boromand-6.png", "moved.csv", "studies.html"]),
        ("draw speed-accuracy", ["spectrum.png", "speed-accuracy.html", "speed-accuracy.csv"]),
        ("draw stability", ["moved.png", "stability.html", "stability.csv"]),
        ("reduce c.toml", ["reference.json.xz", "states.columns.xz", "spectra.columns.xz"]),
        ("compare --n 8", ["comparison.csv", "analysis.csv", "comparison.json", "index.html"]),
        ("compare --n 8 --recipe hoomd", ["packing.npz", "hoomd_check.py"]),
    ],
)
def test_no_file_is_replaced_without_force(tmp_path, words, names):
    (tmp_path / "c.toml").write_text(campaigns.FULL)
    for name in names:
        file = tmp_path / f"folder-{name}" / name
        file.parent.mkdir()
        file.write_text("work of a week")
        done = call_studies(tmp_path, *words.split(), "--out", file.parent)
        assert done.exit_code == 1 and name in done.stderr, done.stderr
        assert file.read_text() == "work of a week" and list(file.parent.glob("*")) == [file]


@pytest.mark.parametrize("word", ["figure", "chart", "compare", "calibrate", "study"])
def test_a_command_that_left_says_what_replaced_it(tmp_path, word):
    done = call(tmp_path, word, "all")
    assert done.exit_code == 2 and "python -m studies" in " ".join(done.stderr.split())
