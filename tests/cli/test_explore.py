"""Pages from the command line: `jamlab explore` of a file, with what the file knows already."""

import json
import re
from pathlib import Path

import pytest
from commands import call

import jamlab
from jamlab.packing.deformation import sheared

DISKS = Path(__file__).parents[1] / "figures" / "states" / "disks.h5"


def rows(path):
    return json.loads(re.search(r'class="head">(.*?)</script>', path.read_text(), re.DOTALL)[1])["rows"]


def test_a_page_from_a_file_takes_the_numbers_stored_there(tmp_path):
    stored = jamlab.read(DISKS)
    sweep = [sheared(stored, 0.01 * k) for k in range(4)]
    jamlab.write(tmp_path / "sweep.h5", sweep, {"pressure": [5.0, 6.0, 7.0, 8.0]})
    done = call(tmp_path, "explore", "sweep.h5", "--out", "page.html", "--every", "2", "--json")
    size = (tmp_path / "page.html").stat().st_size
    assert (done.exit_code, json.loads(done.stdout)) == (0, {"out": "page.html", "states": 2, "bytes": size})
    found = rows(tmp_path / "page.html")
    assert [row["pressure"] for row in found] == [5.0, 7.0]
    assert found[0]["z"] == jamlab.contacts(stored).z


def test_a_dump_makes_a_page_and_what_cannot_leaves_none(tmp_path):
    jamlab.write(tmp_path / "p.dump", [jamlab.read(DISKS)])
    done = call(tmp_path, "explore", "p.dump")
    assert done.exit_code == 0, done.stderr
    assert "wrote explorer.html: 1 state," in done.stdout and len(rows(tmp_path / "explorer.html")) == 1
    done = call(tmp_path, "explore", "p.dump", "--every", "0", "--out", "other.html")
    assert done.exit_code == 1 and done.stderr.count("\n") == 1 and "--every 0" in done.stderr
    assert not (tmp_path / "other.html").exists()


@pytest.mark.parametrize("link", [False, True])
@pytest.mark.parametrize("words", [("explore",), ("compress", "--to", "0.99"), ("relax",)], ids=lambda words: words[0])
def test_what_is_read_is_never_replaced(tmp_path, words, link):
    name = "in.h5"
    jamlab.write(tmp_path / name, [jamlab.read(DISKS)])
    before = (tmp_path / name).read_bytes()
    (tmp_path / "link.h5").symlink_to(name)
    done = call(tmp_path, words[0], name, *words[1:], "--out", "link.h5" if link else name)
    assert done.exit_code == 1 and ("link.h5" if link else name) in done.stderr
    assert (tmp_path / name).read_bytes() == before
