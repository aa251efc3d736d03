"""Pictures of README.md beside what the data that ship would draw today. After a change that is meant:

pytest tests/studies/test_readme_pictures.py --mpl-generate-path=.github
"""

import runpy
from pathlib import Path

import pytest

from studies.papers.forest import forest
from studies.papers.headline import NARROW, headline
from studies.papers.verdicts import compare
from studies.reference_data import open_tables
from studies.registry import CHARTS, MAPS, PAPERS
from studies.speed_accuracy.chart import curve_figure, points_of
from studies.stability.map import failure_figure

ROOT = Path(__file__).parents[2]


def readme_picture(name, dpi=96):
    """Tolerance: fonts move by a pixel between versions of matplotlib; a curve that moves is ten times more."""
    return pytest.mark.mpl_image_compare(
        baseline_dir=str(ROOT / ".github"),
        filename=name,
        style="default",
        tolerance=4,
        savefig_kwargs={"dpi": dpi},
        deterministic=True,
    )


@pytest.fixture(scope="module")
def first():
    """What the script of the first picture defines."""
    return runpy.run_path(str(ROOT / "docs" / "gallery_scripts" / "packings" / "plot_first_picture.py"))


@pytest.mark.slow
@readme_picture("first_picture.png", dpi=150)
def test_first_picture(first):
    return first["draw"]([["onset", "dense", "modulus"]], (10, 3.8))


@pytest.mark.slow
@readme_picture("first_picture_narrow.png", dpi=160)
def test_first_picture_on_a_phone(first):
    return first["draw"]([["onset", "dense"], ["modulus", "modulus"]], (5, 5.4))


@pytest.fixture(scope="module")
def claims():
    return [claim for study in PAPERS for claim in compare(study.name, open_tables())]


@readme_picture("cost_against_error.png", dpi=110)
def test_cost_against_error():
    chart = CHARTS["other-codes"]
    points = points_of(open_tables().read(chart.name))
    shown = points[points["panel"] == "N = 8192"]
    return curve_figure(chart.words["title"], chart.error, shown, chart.words["parameter"])


def test_cpu_times_of_the_readme():
    table = open_tables().read("other-codes")
    large = table[(table["panel"] == "N = 8192") & (table["setting"].astype(float) == 1e-12)]
    times = large.groupby("method")["seconds"].median()
    assert not large[large["method"].isin(["jamlab", "LAMMPS cg", "jax-md"])]["cut"].any()
    told = [f"takes {times['jamlab']:.2g} s;", f"LAMMPS cg takes {times['LAMMPS cg']:.2g} s"]
    told.append(f"jax-md {times['jax-md']:.2g} s")
    text = " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())
    assert all(words in text for words in told), told


@readme_picture("where_methods_fail.png")
def test_where_methods_fail():
    return failure_figure(MAPS["droplet-timestep"], open_tables().read("droplet-timestep"))


@pytest.mark.slow
@readme_picture("papers_forest.png", dpi=100)
def test_all_numbers_of_both_papers(claims):
    return forest(claims).figure


@pytest.mark.slow
@readme_picture("papers_headline.png", dpi=150)
def test_headline_numbers(claims):
    return headline(claims).figure


@pytest.mark.slow
@readme_picture("papers_headline_narrow.png", dpi=192)
def test_headline_numbers_on_a_phone(claims):
    return headline(claims, NARROW).figure
