"""Pages of figures and charts in a real browser: nothing cut on a phone, rows chosen by their verdict."""

from dataclasses import replace

import pandas as pd
import pytest
from drawn_figures import tables
from matplotlib.figure import Figure

from studies.html_page import TextTable
from studies.pages import write_page
from studies.panels import Drawing
from studies.reference_data import example_sections, reference_tables
from studies.registry import groups
from studies.study import Group, Study


@pytest.fixture(scope="module")
def figures_page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("figures")
    papers = groups()["papers"]
    few = [study for study in papers.studies if study.name in ("baumgarten-5", "tables")]
    write_page(folder, "papers", replace(papers, studies=few), tables(), opening=example_sections())
    return folder / "papers.html"


@pytest.fixture(scope="module")
def charts_page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("charts")

    def draw(tables):
        table = TextTable(["method", "a column with a long heading [1/s]"], [["a" * 60, "1"], ["b", "2"]], marks="xy")
        return Drawing("", Figure(figsize=(12, 3)), "caption", rows=[pd.DataFrame([{"method": "a"}])], text=[table])

    studies = [Study(name, f"chart {name}", {}, draw) for name in "abc"]
    write_page(folder, "all", Group("Title", lambda drawings: "Lead.", studies), reference_tables())
    return folder / "all.html"


def shown(browser, selector):
    """Texts of the elements that can be seen on the page."""
    return browser.run(
        "return [...document.querySelectorAll(values[0])].filter(e => e.checkVisibility()).map(e => e.innerText)",
        selector,
    )


@pytest.mark.parametrize("width", [375, 1280])
@pytest.mark.parametrize("page", ["figures_page", "charts_page"])
def test_nothing_is_cut_and_nothing_is_loaded(browser, request, page, width):
    browser.open(request.getfixturevalue(page), width, 812, touch=width == 375)
    assert browser.overhang() == 0
    assert browser.errors() == [] and [name for name in browser.loaded() if not name.startswith("data:")] == []


def test_pictures_come_before_verdicts_and_links_lead_to_them(browser, figures_page):
    browser.open(figures_page)
    assert len(shown(browser, "section figure img")) == 2
    links = browser.run("return [...document.querySelectorAll('nav a')].map(a => a.getAttribute('href'))")
    assert len(links) == 2 + 2
    for link in links[2:]:
        order = browser.run("return [...document.querySelector(values[0]).children].map(e => e.tagName)", link)
        assert order[:3] == ["H2", "FIGURE", "TABLE"]


def test_rows_are_chosen_by_their_verdict(browser, figures_page):
    browser.open(figures_page)
    everything = shown(browser, "tr[data-mark]")
    for label in browser.driver.find_elements("css selector", ".filter label.mark"):
        mark, count = label.get_attribute("data-mark"), int(label.find_element("css selector", "b").text)
        label.click()
        rows = shown(browser, "tr[data-mark]")
        assert len(rows) == count and all(mark in row for row in rows)
        assert 0 < len(shown(browser, "main > section figure img")) <= 2
    browser.element(".filter label").click()
    assert shown(browser, "tr[data-mark]") == everything


def test_a_row_is_a_card_on_a_phone(browser, charts_page):
    """Every cell carries the heading of its column, since there is no room for a row of headings."""
    browser.open(charts_page, 375, 812, touch=True)
    assert shown(browser, "thead") == []
    label = browser.run("return getComputedStyle(document.querySelectorAll('td')[1], '::before').content")
    assert label == '"a column with a long heading [1/s]"'
