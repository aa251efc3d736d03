"""Tutorials show what their code prints and draws: blocks run when the pages are built, in a folder of their own.

What a block prints stands below it, and pictures that it writes below that. A block that fails shows its error there
and is a warning of the build; the rest of its page does not run. `-D run_blocks=0` runs none.
"""

import contextlib
import io
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from traceback import format_exception_only
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.transforms import SphinxTransform
from sphinx.util import logging

PAGES = "tutorials/"
PICTURES = (".png",)
MOST_LINES = 40  # of an output
COLUMNS = "88"  # of what commands print
SHOWN = "shown"  # folder beside the pages that pictures are copied to
_LOGGER = logging.getLogger(__name__)


class RunBlocks(SphinxTransform):
    """Run the blocks of Python and of the shell on one page, and put what they give behind them."""

    default_priority = 10  # before images are collected

    def apply(self, **_: Any) -> None:
        """Run the page."""
        page = self.env.docname
        if not (page.startswith(PAGES) and self.config.run_blocks):
            return
        blocks = [b for b in self.document.findall(nodes.literal_block) if b.get("language") in ("python", "sh")]
        before, namespace = Path.cwd(), {"__name__": "tutorial"}
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            try:
                for k, block in enumerate(blocks):
                    seen = _pictures()
                    said = _run_shell(block.astext()) if block["language"] == "sh" else _run(block, namespace)
                    new = [path for path, written in _pictures().items() if seen.get(path) != written]
                    self._show(block, said, [self._keep(page, k, path) for path in sorted(new)])
            except Exception as error:
                self._show_error(block, error)
            finally:
                os.chdir(before)
                _close_figures()

    @staticmethod
    def _show_error(block: nodes.literal_block, error: Exception) -> None:
        """Say on the page why a block failed, and warn."""
        text = str(error) if isinstance(error, ShellError) else "".join(format_exception_only(error))
        _LOGGER.warning("block fails: %s", text, location=block, type="blocks", subtype="failed")
        shown = nodes.error("", nodes.paragraph("", "This block fails; the blocks below it did not run."))
        shown += nodes.literal_block(text, text, language="none")
        block.parent.insert(block.parent.index(block) + 1, shown)

    def _keep(self, page: str, block: int, path: Path) -> str:
        """Copy a picture beside the pages; its place from there."""
        folder = Path(self.env.srcdir) / PAGES / SHOWN
        folder.mkdir(exist_ok=True)
        name = f"{Path(page).name}-{block + 1}-{path.name}"
        shutil.copy(path, folder / name)
        return f"{SHOWN}/{name}"

    @staticmethod
    def _show(block: nodes.literal_block, said: str, pictures: list[str]) -> None:
        lines = said.rstrip().splitlines()
        if len(lines) > MOST_LINES:
            lines = [*lines[:MOST_LINES], f"... {len(lines) - MOST_LINES} more lines"]
        shown: list[nodes.Node] = []
        if lines:
            text = "\n".join(lines)
            shown.append(nodes.literal_block(text, text, language="none", classes=["output"]))
        for picture in pictures:
            shown.append(nodes.image(uri=picture, alt=f"written by the block above: {Path(picture).name}"))
        at = block.parent.index(block) + 1
        block.parent[at:at] = shown


class ShellError(Exception):
    """A block of the shell that ends with an error."""


def _run(block: nodes.literal_block, namespace: dict[str, Any]) -> str:
    """Run a block of Python; what it prints."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        exec(compile(block.astext(), "tutorial", "exec"), namespace)
    return out.getvalue()


def _run_shell(text: str) -> str:
    """Run a block of the shell with the commands of this environment; what it prints."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    done = subprocess.run(
        ["bash", "-eo", "pipefail", "-c", text],
        env=os.environ | {"PATH": path, "COLUMNS": COLUMNS, "TERM": "dumb"},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise ShellError(f"{text}\nends with {done.returncode}:\n{done.stdout[-2000:]}{done.stderr}")
    return done.stdout


def _pictures() -> dict[Path, int]:
    """Pictures in the folder of the page -> when they were written."""
    return {path: path.stat().st_mtime_ns for path in Path.cwd().iterdir() if path.suffix in PICTURES}


def _close_figures() -> None:
    from matplotlib import pyplot

    pyplot.close("all")


def setup(app: Sphinx) -> dict[str, Any]:
    """Run the blocks while pages are read."""
    app.add_config_value("run_blocks", True, "env", bool)
    app.add_transform(RunBlocks)
    return {"version": "1", "parallel_read_safe": False, "parallel_write_safe": True}
