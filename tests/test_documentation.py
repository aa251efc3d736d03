"""What the documentation must hold: every style has its page, every link its target, the map all functions."""

import json
import re
import runpy
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

import jamlab
from jamlab.engine.installation import PLUGIN_STYLES

ROOT = Path(__file__).parents[1]
PAGES = sorted([*(ROOT / "docs").rglob("*.md"), *ROOT.glob("*.md"), *(ROOT / ".github").rglob("*.md")])
FOLDERS = ("docs", "jamlab", "lammps_inputs", "plugin", "studies", "tests", ".github")
SECTIONS = ["Syntax", "Examples", "Description", "Restrictions", "Related commands", "Default"]
# by the build, which checks links to them
MADE = (
    "gallery/",
    *(f"reference/{name}" for name in ("python/", "arguments.md", "commands.rst", "versions.rst")),
)


def styles():
    """Kinds and names of what the plugin registers, but for those in upper case, which users do not see."""
    source = (ROOT / "plugin" / "jamlab_plugin.cpp").read_text(encoding="utf-8")
    commands = re.findall(r'^    \{"(jamlab/\w+)", &', source, re.MULTILINE)
    styles_there = re.findall(r'^    \{"(\w+)", "([a-z_/]+)", "', source, re.MULTILINE)
    return [*styles_there, *(("command", name) for name in commands)]


def test_every_style_has_a_page_in_the_form_of_lammps():
    titles = {}
    for page in (ROOT / "docs" / "reference" / "lammps").glob("*.md"):
        text = page.read_text(encoding="utf-8")
        titles[text.splitlines()[0]] = re.findall(r"^## (.*)$", text, re.MULTILINE)
    commands = titles.pop("# Commands for programs and decks")
    assert len(styles()) > 12
    assert commands == [name for kind, name in styles() if kind == "command"]
    for kind, name in styles():
        if kind == "command":
            continue
        prefix = {"fix": "fix ", "compute": "compute "}.get(kind, f"{kind}_style ")
        found = titles[f"# {prefix}{name}"]  # output and restart may stand between Description and Restrictions
        assert len(found) < 8 and [*found[:3], *found[-3:]] == SECTIONS, name


def test_doctor_looks_for_every_style():
    assert set(PLUGIN_STYLES) == {style for style in styles() if style[0] != "command"}


def test_links_of_pages_lead_somewhere():
    for page in PAGES:
        for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
            path = (page.parent / target).resolve()
            made = path.is_relative_to(ROOT / "docs") and str(path.relative_to(ROOT / "docs")).startswith(MADE)
            elsewhere = "://" in target or re.fullmatch(r"lammps:\w+", target)  # a page of LAMMPS' manual: docs/conf.py
            assert elsewhere or made or path.exists(), f"{page}: {target}"


def test_files_that_are_named_are_there():
    """Paths from the root, in pages, code and settings."""
    path = re.compile(
        rf"(?<![\w/.-])((?:{'|'.join(map(re.escape, FOLDERS))})/[\w./-]+\.(?:py|cpp|h|csv|md|toml|json|js)"
        r"(?:\.[gx]z)?)\b"
    )
    code = [file for folder in FOLDERS for file in (ROOT / folder).rglob("*") if file.suffix in (".py", ".h", ".cpp")]
    read = {*PAGES, *code, ROOT / "pyproject.toml"} - {ROOT / "CHANGELOG.md"}  # which also names what is gone
    named = [(file, name) for file in read for name in path.findall(file.read_text(encoding="utf-8"))]
    assert len(named) > 50
    missing = [f"{file}: {name}" for file, name in named if not (ROOT / name).exists()]
    assert not missing


def test_paths_of_contributing_are_there():
    """From the root, or from the folder of the library, tests or studies; a name alone anywhere."""
    words = re.findall(r"`([\w/.]+)`", (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"))
    paths = {word for word in words if re.search(r"\w/\w|\w\.(?:py|pyi|md|toml|csv|cpp|h)$", word)}
    places = [ROOT, *(ROOT / folder for folder in ("jamlab", "tests", "studies", "plugin"))]
    names = {path.name for place in places[1:] for path in place.rglob("*")} | {path.name for path in ROOT.iterdir()}
    found = {path for path in paths if any((place / path).exists() for place in places)}
    assert len(found) > 50
    others = {"disk/drag", "docs/build/html"}  # a style, and what a build makes
    assert paths - found - others - {path for path in paths if "/" not in path and path in names} == set()


def test_every_package_has_a_row():
    """The table of packages in CONTRIBUTING.md."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    rows = re.findall(r"`([\w/]+)`", "".join(re.findall(r"^\| (`[^|]*)\| [^|]*\|$", text, re.MULTILINE)))
    packages = {path.parent.name for path in (ROOT / "jamlab").glob("*/__init__.py")}
    assert packages - set(rows) == set()
    assert not [row for row in rows if not (ROOT / "jamlab" / row).is_dir()]


def test_the_map_of_the_package_names_everything_that_can_be_called():
    words = set(re.findall(r"\w+", jamlab.__doc__))
    functions = {name for name in jamlab.__all__ if name[0].islower()} - {"results"}
    assert functions - words == set()


def test_every_public_name_has_a_page(monkeypatch):
    """The build of the reference refuses a name whose module is in no group; Sphinx itself is not needed for this."""
    monkeypatch.setitem(sys.modules, "sphinx", SimpleNamespace())
    monkeypatch.setitem(sys.modules, "sphinx.application", SimpleNamespace(Sphinx=None))
    pages = runpy.run_path(str(ROOT / "docs" / "extensions" / "reference_pages.py"))
    found = [name for names in pages["grouped"]().values() for name in names]
    assert set(jamlab.__all__) - {"results"} <= set(found)


def test_the_picture_of_the_layers_has_every_package_and_its_purpose(monkeypatch):
    for name in ("sphinx", "sphinx.application", "sphinx.util", "sphinx.util.docutils"):
        monkeypatch.setitem(sys.modules, name, SimpleNamespace(Sphinx=None, SphinxDirective=object))
    page = runpy.run_path(str(ROOT / "docs" / "extensions" / "layers_picture.py"))
    drawn = page["picture"](page["contract"]())
    packages = {path.parent.name for path in (ROOT / "jamlab").glob("*/__init__.py")}
    assert packages <= set(re.findall(r">(\w+)</text>", drawn)) and "<title></title>" not in drawn
    assert drawn.count(page["COLOURS"]["LAMMPS"]) == 2 * 3  # engine, protocols, flow


def first_script():
    """Code of the README, and what it says that the code prints."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    ((code, printed),) = re.findall(r"```python\n(.*?)```\n.*?```text\n(.*?)```", text, re.DOTALL)
    return code, printed


@pytest.mark.slow
def test_the_first_script_of_the_readme_prints_what_stands_there(tmp_path, monkeypatch, capsys):
    """Numbers to about a unit of their last digit, as they are rounded."""
    monkeypatch.chdir(tmp_path)
    code, printed = first_script()
    exec(code, {})
    lines = (text.splitlines() for text in (capsys.readouterr().out, printed))
    given, told = ([re.split(" = | {3}", line) for line in text] for text in lines)
    assert [line[::2] for line in given] == [line[::2] for line in told]
    for ours, theirs in zip(given, told, strict=True):
        assert [float(x) for x in ours[1::2]] == pytest.approx([float(x) for x in theirs[1::2]], rel=2e-3, abs=1.5e-3)
    assert (tmp_path / "droplets.html").stat().st_size > 1e4


def test_the_notebook_holds_the_first_script():
    """What else it has installs the package or draws a result."""
    cells = json.loads((ROOT / "docs" / "examples" / "first_script.ipynb").read_text(encoding="utf-8"))["cells"]
    code = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code").splitlines()
    more = [line for line in code if line.startswith("%pip install") or line.endswith(".plot();")]
    script = [line for line in first_script()[0].splitlines() if line]
    assert [line for line in code if line and line not in more] == script
