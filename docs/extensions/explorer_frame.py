"""The directive `explorer`: a sweep of droplets as an interactive frame within a page, made when pages are built.

Its content is the caption.
"""

from html import escape
from pathlib import Path
from typing import Any

from docutils import nodes
from markupsafe import Markup
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

import jamlab
from jamlab.figures.explorer.write_page import explorer_assets, explorer_fragment

FILE = "explorer.html"
FIRST = 5  # state that is shown at first
PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
{assets}
<style>
  :root {{ color-scheme: light dark; }}
  body {{ font: 14px/1.4 system-ui, sans-serif; margin: 0; color: #1a1a1a; background: #fff; }}
  .explorer {{ gap: .2rem 1rem; }}
  .explorer .keys, .explorer .axis, .explorer .legend {{ display: none; }}
  .explorer .toggles {{ margin: 0; gap: 0 .8rem; }}
  .explorer dd {{ white-space: nowrap; }}
  .explorer .numbers {{ grid-template-columns: max-content minmax(0, 1fr); }}
  .explorer dd:last-child {{ grid-column: 2; }}
  .explorer .curve-figure {{ margin-top: .2rem; }}
  @media screen and (prefers-color-scheme: dark) {{ body {{ color: #e6e6e6; background: #131416; }} }}
  @media screen and (min-width: 560px) and (max-width: 800px) {{
    .explorer {{ grid-template-columns: minmax(0, 1.4fr) minmax(0, 1fr); }}
  }}
  @media screen and (max-width: 559px) {{ .explorer .curve-figure {{ display: none; }} }}
</style>
</head>
<body>
{fragment}
<script>addEventListener('load', () => document.querySelector('.explorer').explorer.show({first}))</script>
</body>
</html>
"""


class Explorer(SphinxDirective):
    """Place the frame."""

    has_content = True

    def run(self) -> list[nodes.Node]:
        """A frame of the file beside the pages, and a caption."""
        up = "../" * self.env.docname.count("/")
        frame = f'<iframe class="explorer-frame" src="{up}_static/{FILE}" title="explorer" loading="lazy"></iframe>'
        figure = nodes.container(classes=["explorer-place"])
        figure += nodes.raw("", frame, format="html")
        figure += self.parse_content_to_nodes()
        return [figure]


def sweep() -> list[Any]:
    """Droplets from onset until they are strongly deformed; G is positive in every state."""
    onset = jamlab.jam(model="dp", n=32, seed=1, ensemble="shear-stabilized")
    return [onset, *jamlab.compress(onset, to=0.98, step=0.02)]


def write_frame(app: Sphinx, failed: Exception | None) -> None:
    """Write the file that the frame shows, if it is missing or older than the library."""
    if failed or app.builder.format != "html":
        return
    target, library = Path(app.outdir) / "_static" / FILE, Path(jamlab.__file__).parent
    newest = max(path.stat().st_mtime for path in library.rglob("*") if path.suffix in (".py", ".js", ".css", ".html"))
    if target.exists() and target.stat().st_mtime > newest:
        return
    states = sweep()
    page = PAGE.format(
        title=escape(f"{states[0].n} droplets"),
        assets=explorer_assets(),
        fragment=Markup(explorer_fragment(states)),
        first=min(FIRST, len(states) - 1),
    )
    target.write_text(page, encoding="utf-8")


def setup(app: Sphinx) -> dict[str, Any]:
    """Add the directive, and make its file at the end."""
    app.add_directive("explorer", Explorer)
    app.connect("build-finished", write_frame)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
