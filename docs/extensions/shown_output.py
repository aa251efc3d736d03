"""Tutorials show what their code prints and draws: blocks run when the pages are built, in a folder of their own.

A block that fails stops the build. What a block prints stands below it, and pictures that it writes below that.
"""

import contextlib
import io
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.transforms import SphinxTransform

PAGES = "tutorials/"
PICTURES = (".png",)
MOST_LINES = 40  # of an output
SHOWN = "shown"  # folder beside the pages that pictures are copied to


class RunBlocks(SphinxTransform):
    """Run the blocks of Python and of the shell on one page, and put what they give behind them."""

    default_priority = 10  # before images are collected

    def apply(self, **_: Any) -> None:
        """Run the page."""
        page = self.env.docname
        if not page.startswith(PAGES):
            return
        blocks = [b for b in self.document.findall(nodes.literal_block) if b.get("language") in ("python", "sh")]
        before, namespace = Path.cwd(), {"__name__": "tutorial"}
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            try:
                for k, block in enumerate(blocks):
                    seen = _pictures()
                    try:
                        said = _run_shell(block.astext()) if block["language"] == "sh" else _run(block, namespace)
                    except Exception as error:
                        raise ExtensionError(f"{page}, block {k + 1}: {error}") from error
                    new = [path for path, written in _pictures().items() if seen.get(path) != written]
                    self._show(block, said, [self._keep(page, k, path) for path in sorted(new)])
            finally:
                os.chdir(before)
                _close_figures()

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
        env=os.environ | {"PATH": path, "COLUMNS": "100", "TERM": "dumb"},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise RuntimeError(f"{text}\nends with {done.returncode}:\n{done.stdout[-2000:]}{done.stderr}")
    return done.stdout


def _pictures() -> dict[Path, int]:
    """Pictures in the folder of the page -> when they were written."""
    return {path: path.stat().st_mtime_ns for path in Path.cwd().iterdir() if path.suffix in PICTURES}


def _close_figures() -> None:
    from matplotlib import pyplot

    pyplot.close("all")


def setup(app: Sphinx) -> dict[str, Any]:
    """Run the blocks while pages are read."""
    app.add_transform(RunBlocks)
    return {"version": "1", "parallel_read_safe": False, "parallel_write_safe": True}
