"""How pages read and how they are built: symbols as equations, code as wide as a page, facts from their source."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from mathml import MathError, mathml
from project_facts import DOCS, PROJECT, extras_table, links, substitutions, theme_options
from words_of_pages import long_code, raw_marks

ROOT = DOCS.parent
MADE = {"build", "gallery", "arguments.md"}  # when the pages are built
PAGES = [page for page in sorted(DOCS.rglob("*.md")) if not MADE & set(page.relative_to(DOCS).parts)]
WIDTH = 88  # columns of code that a page shows without scrolling
ACCENTED = '<mover><mi>u</mi><mo stretchy="false">˙</mo></mover>'


def flat(tex):
    return re.sub(r"\s*\n\s*", "", mathml(tex))


def test_pages_have_no_raw_underscores_or_carets():
    assert not [line for page in (*PAGES, ROOT / "README.md") for line in raw_marks(page)]


def test_raw_marks_are_found(tmp_path):
    page = tmp_path / "page.md"
    page.write_text('*k*_a and\n`k_a`, $k_a$, "k_a" of\n\nE ~ *t*^0.02\n\n| z_J |\n|---|\n| 1 |\n', encoding="utf-8")
    assert [int(line.split(":")[1]) for line in raw_marks(page)] == [1, 4, 6]


def test_code_is_as_wide_as_a_page():
    assert not [line for page in PAGES for line in long_code(page, WIDTH)]


def test_subscripts_of_accented_letters_stand_beside_them():
    """docutils puts them below, as limits."""
    assert f"<msub>{ACCENTED}<mi>n</mi></msub>" in flat(r"\dot u_n")
    assert f'<msubsup>{ACCENTED}<mo lspace="0" rspace="0">∥</mo><mn>2</mn></msubsup>' in flat(r"{\dot u}_\parallel^2")
    assert flat(r"\langle u\rangle^2").count('stretchy="false"') == 2
    assert "<munderover>" in flat(r"\sum_{i=1}^N u_i")
    assert "<msubsup><mi>G</mi><mn>0</mn>" in flat("G_0^*") and "∗" in flat("G^*")


@pytest.mark.parametrize("tex", ["^{1/2}", r"\unknown", r"\frac"])
def test_equations_that_cannot_be_translated_are_refused(tex):
    with pytest.raises(MathError):
        mathml(tex)


def test_every_extra_has_a_purpose():
    table = extras_table(PROJECT["optional-dependencies"])
    assert "| `'.[trajectories]'` | gsd |" in table and "| `'.[studies]'` | images, parquet |" in table
    with pytest.raises(ValueError, match="other"):
        extras_table(PROJECT["optional-dependencies"] | {"other": []})


def test_substitutions_on_pages_are_known():
    used = {name for page in PAGES for name in re.findall(r"\{\{ *(\w+) *\}\}", page.read_text(encoding="utf-8"))}
    assert used <= set(substitutions())


def test_the_readme_counts_the_gallery():
    found = re.search(r"(\d+) scripts", (ROOT / "README.md").read_text(encoding="utf-8"))
    assert found is None or found[1] == substitutions()["n_gallery"]


def test_pages_link_to_the_repository_once_it_has_an_address():
    assert links({}) == theme_options({}) == {}
    urls = {"Repository": "https://example.org/jamlab", "Issues": "https://example.org/jamlab/issues"}
    assert list(links(urls).values()) == list(urls.values())
    assert theme_options(urls)["source_repository"] == urls["Repository"]


@pytest.fixture
def site(tmp_path):
    """A site with one tutorial whose second of three blocks fails."""
    pytest.importorskip("sphinx", reason="Sphinx is not installed")
    pytest.importorskip("myst_parser", reason="myst-parser is not installed")
    (tmp_path / "tutorials").mkdir()
    conf = (
        f"import sys\nsys.path.insert(0, {str(DOCS / 'extensions')!r})\nextensions = ['myst_parser', 'shown_output']\n"
    )
    (tmp_path / "conf.py").write_text(conf, encoding="utf-8")
    (tmp_path / "index.md").write_text("# Index\n\n```{toctree}\ntutorials/one\n```\n", encoding="utf-8")
    blocks = "".join(f"```python\n{code}\n```\n\n" for code in ("print(6 * 7)", "raise ValueError('no')", "print(0)"))
    (tmp_path / "tutorials" / "one.md").write_text(f"# One\n\n{blocks}", encoding="utf-8")
    return tmp_path


def test_a_block_that_fails_shows_its_error_and_fails_the_check(site):
    build = [sys.executable, "-m", "sphinx", "-q", "-W", str(site), str(site / "html")]
    done = subprocess.run(build, capture_output=True, text=True, check=False)
    page = Path(site, "html", "tutorials", "one.html").read_text(encoding="utf-8")
    assert done.returncode == 1 and "ValueError: no" in done.stderr
    assert "42" in page and "ValueError: no" in page and "did not run" in page
