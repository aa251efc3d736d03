"""The package for LAMMPS' own tree: its manual pages, its sources, and the program that puts both into a tree."""

import io
import os
import re
import subprocess
import sys
from pathlib import Path

import docutils.core
import pytest
from docutils import nodes
from docutils.parsers.rst import Directive, directives, roles

sys.path.append(str(Path(__file__).parents[2] / "plugin" / "recipes" / "lammps"))

import example_logs
import manual_page
import tree_changes
import write_package

PAGES = [name for name in write_package.STYLES if name != "fix_polygon_outline"]  # that fix is not for inputs
SECTIONS = ["Syntax", "Examples", "Description", None, "Restrictions", "Related commands", "Default"]


class Accepted(Directive):
    """A directive of Sphinx, which docutils does not have."""

    has_content = True
    optional_arguments = 1
    final_argument_whitespace = True

    def run(self):
        return [nodes.literal_block("", "\n".join(self.content))]


def role(name, rawtext, text, lineno, inliner, options=None, content=()):
    """A link of Sphinx: to a page, or to a label that the page must have."""
    words, target = re.fullmatch(r"([^<>]+)\s<([\w-]+)>", text).groups()
    if name == "doc":
        return [nodes.inline(rawtext, words, page=target)], []
    node = nodes.reference(rawtext, words, refname=target.lower())
    inliner.document.note_refname(node)
    return [node], []


@pytest.fixture(scope="module", autouse=True)
def sphinx():
    """Tells docutils about Sphinx."""
    for directive in ("index", "code-block", "versionadded"):
        directives.register_directive(directive, Accepted)
    for name in ("doc", "ref"):
        roles.register_local_role(name, role)


def parsed(text):
    """The document, which docutils makes without any message, not even one for information."""
    stream = io.StringIO()
    document = docutils.core.publish_doctree(text, settings_overrides={"report_level": 1, "warning_stream": stream})
    assert stream.getvalue() == ""
    return document


def pages_linked(document):
    return {node["page"] for node in document.findall(nodes.inline) if node.get("page")}


@pytest.mark.parametrize("name", PAGES)
def test_manual_pages_render(name):
    """Every section stands under its title, tables hold what they hold in the source, links are links."""
    text, markdown = manual_page.page(name), (manual_page.PAGES / f"{name}.md").read_text(encoding="utf-8")
    document = parsed(text)
    kind, style = name.split("_")[0], write_package.STYLES[name][1]
    command = f"{kind}_style" if kind in ("pair", "bond") else kind
    (whole,) = (node for node in document.children if isinstance(node, nodes.section))
    assert whole.next_node(nodes.title).astext() == f"{command} {style} command"
    sections = [node for node in whole.children if isinstance(node, nodes.section)]
    titles = [node.next_node(nodes.title).astext() for node in sections]
    assert titles == [title or manual_page.RESTART[command] for title in SECTIONS]
    assert all(len(node.children) > 1 for node in sections)

    rows = [line for line in markdown.splitlines() if re.match(r"\|(?!-)", line)]
    assert len(list(document.findall(nodes.row))) == len(rows)
    assert len(list(document.findall(nodes.math_block))) == markdown.count("$$") // 2
    arguments = bool(re.search(r"## Syntax\n\n```text\n((?!```).+\n)+\n", markdown))  # a block of their own
    blocks = markdown.count("```") // 2 + arguments + 2  # index, versionadded
    assert len(list(document.findall(nodes.literal_block))) == blocks

    assert text.isascii()
    assert not re.search(r"jamlab|\]\(|\{cite|\$|\b(fix|compute|group|atom|molecule) IDs?\b", text)
    assert {"Build_package"} <= pages_linked(document)
    cited = {manual_page.author(key) for key in re.findall(r"\{cite:t\}`(\w+)`", markdown)}
    labels = {name for name, of_target in document.nametypes.items() if of_target and "-" in name}
    assert labels == {f"{name.replace('_', '-')}-{author}".lower() for author in cited}


def test_other_pages_of_the_manual_render():
    document = parsed(write_package.HOWTO.read_text())
    assert {*PAGES} <= pages_linked(document)
    package = tree_changes.DETAILS.removesuffix("----------\n\n")
    parsed(f"{package}:ref:`POLYGON <PKG-POLYGON>`\n\n{tree_changes.EDGE}:ref:`edge <err_polygon_edge>`\n")


@pytest.fixture(scope="module")
def requests(tmp_path_factory):
    """Folder of both pull requests, without the files for testers."""
    folder = tmp_path_factory.mktemp("package")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(write_package, "write_all", lambda folder, styles: None)
        write_package.write_requests(folder)
    return folder


def test_sources_are_written_as_lammps_asks(requests):
    paths = sorted(requests.glob("?/src/POLYGON/*.*"))
    assert {f"{name}.cpp" for name in write_package.STYLES} <= {path.name for path in paths}
    of_plugin = {path.name for path in write_package.SOURCE.rglob("*.h")} - {path.name for path in paths}
    for path in paths:
        text = path.read_text()
        assert not of_plugin & {*re.findall(r'#include "(?:\w+/)*(\w+\.h)"', text)}, path
        assert text.isascii() and not re.search("jamlab|__attribute__|stringstream|citeme", text, re.IGNORECASE), path
        assert text.count("#pragma omp") == len(re.findall(r"#if defined\(_OPENMP\)\n#pragma omp .*\n#endif\n", text))
        if path.suffix == ".h":
            assert "using " not in re.sub(r"//.*|/\*[\s\S]*?\*/", "", text), path
            assert f"#define LMP_{path.stem.upper()}_H\n" in text


LINES = """\
  PTM
pkg_depends(ATC MANYBODY)
\tptm \\
if (test "$1" = "PERI") then
/angle.cpp
src/PTM/*  @someone
   * - :ref:`PTM <PKG-PTM>`
   * :ref:`PTM <PKG-PTM>`
.. _PKG-PTM:
   * :doc:`mesocnt <a>`
* :doc:`mesocnt <a>`
   * :doc:`pour <a>`
* :doc:`pour <a>`
   * :doc:`pressure <a>`
* :doc:`pressure <a>`
   * :doc:`colloid <a>`
* :doc:`colloid <a>`
   Howto_polarizable
.. _err0001:
"""  # one for each pattern


def test_a_tree_gets_the_package_once_in_its_own_form(requests, tmp_path):
    """Nothing changes where a file is not as expected; what is there once is not added twice."""

    def put(request, code=0):
        line = [sys.executable, requests / str(request) / "tree_changes.py", tmp_path]
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        done = subprocess.run(line, env=os.environ | {"PATH": path}, capture_output=True, text=True, check=False)
        assert done.returncode == code and "Traceback" not in done.stderr, done.stderr
        return {path: path.read_text() for path in tmp_path.rglob("*") if path.is_file()}

    assert put(1, code=1) == {}  # no tree
    changes = [*tree_changes.changes(1, []), *tree_changes.changes(2, [])]
    for name in {tree_changes.DICTIONARY, *(name for name, *_ in changes)}:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(LINES)
    (tmp_path / tree_changes.DICTIONARY).write_text("Bosch\ncis\n")
    before = put(1, code=1)  # no settings of clang-format
    assert set(before.values()) == {LINES, "Bosch\ncis\n"}
    (tmp_path / "src" / ".clang-format").write_text("BasedOnStyle: LLVM\nColumnLimit: 100\nReflowComments: false\n")
    put(1)
    after = put(2)
    for name, _, added in changes:
        assert not added or after[tmp_path / name].count(added) == 1, name
    assert "  POLYGON\n  PTM\n" in after[tmp_path / "cmake" / "CMakeLists.txt"]
    assert after[tmp_path / tree_changes.DICTIONARY].startswith("Boromand\nBosch\ncirculoline\ncis\n")
    sources = [text for path, text in after.items() if path.parent.name == "POLYGON"]
    assert len(sources) > 20
    assert max(len(line) for text in sources for line in text.splitlines()) <= 100
    assert put(1) == put(2) == after
    examples = {path.name for path in (tmp_path / "examples" / "PACKAGES" / "polygon").iterdir()}
    assert {"in.funnel", "data.funnel", "polygon12.mol", "wall.mol"} <= examples
    assert write_package.foreign() == {"overdamped", "disk/drag"}
    strange = re.compile(r"\.\./parts|funnel\.data|overdamped|disk/drag|jamlab")
    assert not any(strange.search(after[path]) for path in after if path.name in examples)


@pytest.mark.slow
def test_logs_of_examples_have_the_names_that_lammps_asks_for(tmp_path, monkeypatch):
    """On one rank and on several, without a word of the plugin and with the papers to cite."""
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    deck = "region box block 0 4 0 4 0 4\ncreate_box 1 box\nmass 1 1.0\nrun 0\n"
    (tmp_path / "in.empty").write_text(deck)
    paths = example_logs.write_logs(tmp_path, ranks=(1, 2))
    assert [re.sub(r"\d+\w{3}\d{4}", "DATE", path.name) for path in paths] == [
        "log.DATE.empty.g++.1",
        "log.DATE.empty.g++.2",
    ]
    for count, path in enumerate(paths, 1):
        text = path.read_text()
        assert re.search(rf"^Loop time of .* on {count} procs", text, re.MULTILINE) and "plugin" not in text
    assert {path.name for path in tmp_path.iterdir()} == {"in.empty", *(path.name for path in paths)}
