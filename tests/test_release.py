"""One version everywhere: package, citation, changelog."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_citation_and_changelog_name_the_version_of_the_package():
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text()
    newest, date = re.findall(r"^## \[([\d.]+)\] - (.*)$", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)[0]
    assert newest == version and (date == "unreleased" or re.fullmatch(r"\d{4}-\d\d-\d\d", date))
