"""The page of a campaign: an explorer and means for every sweep that has states, counts for all."""

import campaigns
import pytest
from commands import call

import jamlab
from jamlab.cli.campaign_report import write_campaign_page


@pytest.mark.slow
def test_every_sweep_has_a_section(full, tmp_path):
    told = []
    write_campaign_page(full, tmp_path / "page.html", lambda *done: told.append(done))
    page = (tmp_path / "page.html").read_text()
    sections = page.split("<section id=")[1:]
    assert [part.split('"')[1] for part in sections] == ["up", "sheared", "droplets"]
    assert [text for _, text in told] == ["up", "sheared", "droplets"]
    assert [share for share, _ in told] == pytest.approx([1 / 3, 2 / 3, 1])
    for part in sections:
        assert part.count("<canvas") == part.count("data:image/png") == part.count("<thead>") == 1
    assert "6 of 6" in page


def test_a_campaign_without_a_finished_task_has_no_page(tmp_path):
    campaigns.written(tmp_path / "c.toml")
    done = call(tmp_path, "campaign", "page", "c.toml")
    assert done.exit_code == 1 and "no task of c is finished: run `jamlab campaign run" in done.stderr
    assert not (tmp_path / "campaign.html").exists()


def test_a_page_that_cannot_be_written_is_refused_first(full, tmp_path):
    with pytest.raises(jamlab.StorageError, match="absent"):
        write_campaign_page(full, tmp_path / "absent" / "page.html")
