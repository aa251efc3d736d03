"""Pictures of README.md beside what the data that ship would draw today. After a change that is meant:

pytest tests/studies/test_readme_pictures.py --mpl-generate-path=.github
"""

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
def claims():
    return [claim for study in PAPERS for claim in compare(study.name, open_tables())]


@readme_picture("cost_against_error.png")
def test_cost_against_error():
    chart = CHARTS["other-codes"]
    points = points_of(open_tables().read(chart.name))
    return curve_figure(chart.words["title"], chart.words["error"], points[points["panel"] != "N = 1024"])


@readme_picture("where_methods_fail.png")
def test_where_methods_fail():
    return failure_figure(MAPS["droplet-timestep"], open_tables().read("droplet-timestep"))


@pytest.mark.slow
@readme_picture("papers_forest.png", dpi=60)
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
