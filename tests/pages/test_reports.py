"""Pages of a campaign and of the demo in a real browser: nothing cut on a phone, nothing loaded from elsewhere."""

import pytest
from commands import call

from jamlab.cli.campaign_report import write_campaign_page


@pytest.mark.parametrize("width", [375, 1280])
def test_nothing_of_a_campaign_is_cut_and_nothing_is_loaded(browser, full, tmp_path, width):
    write_campaign_page(full, tmp_path / "page.html")
    browser.open(tmp_path / "page.html", width, 812, touch=width == 375)
    assert browser.overhang() == 0
    assert browser.errors() == [] and [name for name in browser.loaded() if not name.startswith("data:")] == []


@pytest.mark.slow
def test_demo_opens_with_two_explorers(browser, tmp_path):
    assert call(tmp_path, "demo", "--n", "8", "--to", "0.88").exit_code == 0
    for width in (375, 1280):
        browser.open(tmp_path / "jamlab-demo" / "index.html", width, 812, touch=width == 375)
        assert browser.errors() == [] and browser.overhang() == 0
        assert len(browser.driver.find_elements("css selector", ".explorer canvas")) == 2
