"""Pages of figures and charts in a real browser: nothing cut on a phone, rows chosen by their verdict."""

import re
from dataclasses import replace

import pytest
from drawn_figures import drawn, tables

from studies.pages import write_page
from studies.papers import forest, headline
from studies.registry import GROUPS

NAMES = ("tables", "baumgarten-5")  # in the order of the page


@pytest.fixture(scope="module")
def figures_page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("figures")
    papers = GROUPS["papers"]
    few = [study for study in papers.studies if study.name in NAMES]
    write_page(folder, "papers", replace(papers, studies=few), tables())
    return folder / "papers.html"


def shown(browser, selector):
    """Texts of the elements that can be seen on the page."""
    return browser.run(
        "return [...document.querySelectorAll(values[0])].filter(e => e.checkVisibility()).map(e => e.innerText)",
        selector,
    )


def test_the_page_marks_every_number_and_links_it_to_its_figure(figures_page):
    page, claims = figures_page.read_text(), [c for name in NAMES for c in drawn(name).claims]
    assert all(figures_page.with_name(f"{name}.png").exists() for name in (forest.NAME, headline.NAME))
    assert page.count("data:image/png;base64,") == 1 + len(NAMES)
    assert not re.search(r"(src|href)=\"(?!data:|#)", page)  # nothing from elsewhere
    links = re.findall('<a role="listitem" data-mark="([^"]*)" href="#([^"]*)"', page)
    assert [mark for mark, _ in links] == [c.verdict for c in claims if c.statement.counted and c.measured.known]
    assert {place for _, place in links} == set(re.findall('<section id="((?:baumgarten|tables)[^"]*)"', page))
    assert 0 < page.count('<tr data-mark="agrees"') == sum(c.verdict == "agrees" for c in claims) < len(claims)
    assert page.count("<tr data-mark=") == len(claims)
    assert page.index("data:image") < page.index("<tr data-mark=")  # pictures first


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
        assert 0 < len(shown(browser, "main > section figure img")) <= 1 + len(NAMES)
    browser.element(".filter label").click()
    assert shown(browser, "tr[data-mark]") == everything
