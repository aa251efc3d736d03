"""Pages of a campaign and of the demo in a real browser: nothing cut on a phone, nothing loaded from elsewhere."""

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
