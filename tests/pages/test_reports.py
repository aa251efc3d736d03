"""Pages of a campaign and of the demo in a real browser: nothing cut on a phone, nothing loaded from elsewhere."""

import pytest
from commands import call

from jamlab.cli.campaign_report import write_campaign_page

WIDTHS = (375, 1280)


def assert_whole(browser, page, explorers):
    for width in WIDTHS:
        browser.open(page, width, 812, touch=width == 375)
        assert browser.errors() == [] and browser.overhang() == 0
        assert [name for name in browser.loaded() if not name.startswith("data:")] == []
        assert len(browser.driver.find_elements("css selector", ".explorer canvas")) == explorers


def test_nothing_of_a_campaign_is_cut_and_nothing_is_loaded(browser, full, tmp_path):
    write_campaign_page(full, tmp_path / "page.html")
    assert_whole(browser, tmp_path / "page.html", 3)


@pytest.mark.slow
def test_demo_opens_with_two_explorers(browser, tmp_path):
    assert call(tmp_path, "demo", "--n", "8", "--to", "0.88").exit_code == 0
    assert_whole(browser, tmp_path / "jamlab-demo" / "index.html", 2)
