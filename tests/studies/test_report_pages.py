"""Pages of figures and charts in a real browser: nothing cut on a phone, rows chosen by their verdict."""

from dataclasses import replace

import pytest
from drawn_figures import tables

from studies.pages import write_page
from studies.registry import GROUPS


@pytest.fixture(scope="module")
def figures_page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("figures")
    papers = GROUPS["papers"]
    few = [study for study in papers.studies if study.name in ("baumgarten-5", "tables")]
    write_page(folder, "papers", replace(papers, studies=few), tables())
    return folder / "papers.html"


def shown(browser, selector):
    """Texts of the elements that can be seen on the page."""
    return browser.run(
        "return [...document.querySelectorAll(values[0])].filter(e => e.checkVisibility()).map(e => e.innerText)",
        selector,
    )


@pytest.mark.parametrize("width", [375, 1280])
def test_nothing_is_cut_and_nothing_is_loaded(browser, figures_page, width):
    browser.open(figures_page, width, 812, touch=width == 375)
    assert browser.overhang() == 0
    assert browser.errors() == [] and [name for name in browser.loaded() if not name.startswith("data:")] == []


def test_rows_are_chosen_by_their_verdict(browser, figures_page):
    browser.open(figures_page)
    everything = shown(browser, "tr[data-mark]")
    for label in browser.driver.find_elements("css selector", ".filter label.mark"):
        mark, count = label.get_attribute("data-mark"), int(label.find_element("css selector", "b").text)
        label.click()
        rows = shown(browser, "tr[data-mark]")
        assert len(rows) == count and all(mark in row for row in rows)
        lines = "[...document.querySelectorAll('.forest a')].filter(a => a.offsetParent)"
        assert set(browser.run(f"return {lines}.map(a => a.dataset.mark)")) <= {mark}
        assert 0 < len(shown(browser, "main > section figure img")) <= 2
    browser.element(".filter label").click()
    assert shown(browser, "tr[data-mark]") == everything
