"""Run the code of these pages, blocks of Python and of the shell (`sh`): each page in a folder of its own."""

import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib
from example_package import install
from sybil import Example, Sybil
from sybil.parsers.myst import CodeBlockParser, PythonCodeBlockParser

matplotlib.use("agg")
_SITE = TemporaryDirectory()  # with the package of docs/extending, whose entry points no installer has written
sys.path.insert(0, str(install(Path(_SITE.name))))
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [_SITE.name, os.environ.get("PYTHONPATH")]))


class ShellBlockParser(CodeBlockParser):
    """Blocks of the shell: the first command that fails is an error."""

    language = "sh"

    def evaluate(self, example: Example) -> None:
        """Run one block with the commands of this environment."""
        path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
        done = subprocess.run(
            ["bash", "-eo", "pipefail", "-c", str(example.parsed)],
            env=os.environ | {"PATH": path},
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            raise AssertionError(f"{example.parsed}\nends with {done.returncode}:\n{done.stdout[-2000:]}{done.stderr}")


def enter(namespace: dict[str, object]) -> None:
    """Go into a new folder before the first block of a page."""
    folder = TemporaryDirectory()
    namespace.update(folder=folder, before=Path.cwd())
    os.chdir(folder.name)


def leave(namespace: dict[str, object]) -> None:
    """Close what the page has drawn and leave its folder after the last block."""
    from matplotlib import pyplot

    pyplot.close("all")
    os.chdir(str(namespace["before"]))
    namespace["folder"].cleanup()  # type: ignore[attr-defined]


pytest_collect_file = Sybil(
    parsers=[PythonCodeBlockParser(), ShellBlockParser()],
    patterns=["*.md"],
    excludes=["gallery/*", "build/*", "tutorials/*"],  # tutorials run when pages are built, see shown_output.py
    setup=enter,
    teardown=leave,
).pytest()
