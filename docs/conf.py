"""Sphinx settings. Build and check all of the documentation: `docs/check`, see CONTRIBUTING.md."""

import sys
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS / "extensions"))

from project_facts import PROJECT, links, substitutions, theme_options  # noqa: E402

project = "jamlab"
author = "The jamlab authors"
copyright = "the jamlab authors, GPL-2.0-or-later"
version = release = PROJECT["version"]

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx_gallery.gen_gallery",
    "sphinx_design",
    "sphinx_copybutton",
    "sphinxcontrib.bibtex",
    "myst_parser",
    "explorer_frame",
    "layers_picture",
    "mathml_equations",
    "plain_docstrings",
    "reference_pages",
    "shown_output",
]
exclude_patterns = ["gallery_scripts", "examples", "gallery/**/*.ipynb", "gallery/**/*.py", "README.md"]
templates_path = ["templates"]
default_role = "py:obj"  # `names` in docstrings are links where they name something public
suppress_warnings = [
    "config.cache",  # functions in the settings of the gallery
    "ref.python",  # attributes of several results have one name, such as `storage`
]

myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath", "substitution"]
myst_substitutions = substitutions()  # `{{ name }}` on the pages
myst_heading_anchors = 3
myst_url_schemes = {"http": None, "https": None, "mailto": None, "lammps": "https://docs.lammps.org/{{path}}.html"}

autodoc_typehints = "none"  # docstrings say types, shapes and units
autodoc_member_order = "bysource"
python_maximum_signature_line_length = 80
napoleon_numpy_docstring = False
napoleon_use_ivar = True
napoleon_attr_annotations = False  # as autodoc_typehints
autosummary_generate = False

SECTIONS = ("packings", "structure", "elasticity", "oscillation", "flow", "elsewhere")  # of the gallery

bibtex_bibfiles = ["references.bib"]
bibtex_default_style = "unsrt"
bibtex_reference_style = "author_year"

sphinx_gallery_conf = {
    "examples_dirs": "gallery_scripts",
    "gallery_dirs": "gallery",
    "filename_pattern": r"/",
    "subsection_order": [f"gallery_scripts/{name}" for name in SECTIONS],
    "within_subsection_order": "FileNameSortKey",
    "copyfile_regex": r".*\.(toml)",
    "min_reported_time": 20,
    "remove_config_comments": True,
    "only_warn_on_example_error": True,  # the error stands on the page
    "capture_repr": ("_repr_html_",),
    "backreferences_dir": "gallery/backreferences",  # thumbnails on the pages of functions
    "doc_module": ("jamlab",),
    "write_computation_times": False,
    "default_thumb_file": None,
    "reset_modules": ("matplotlib",),
}

html_theme = "furo"
html_theme_options = theme_options(PROJECT["urls"])
html_title = f"jamlab {release}"
html_static_path = ["static"]
html_css_files = ["jamlab.css"]
html_search_scorer = str(DOCS / "static" / "scorer.js")
html_sidebars = {
    "**": [
        *("sidebar/brand.html", "sidebar/search.html", "sidebar/scroll-start.html", "sidebar/navigation.html"),
        *("sidebar/links.html", "sidebar/scroll-end.html"),
    ]
}
html_context = {"project_links": links(PROJECT["urls"])}
html_show_sourcelink = False
html_copy_source = False
pygments_style = "friendly"

MADE = ("gallery/", "reference/python/", "reference/arguments", "reference/commands", "reference/versions")


def drop_edit_link(app: Any, pagename: str, templatename: str, context: dict[str, Any], doctree: Any) -> None:
    """Pages that are made when the documentation is built have no source to edit."""
    if pagename.startswith(MADE):
        context["page_source_suffix"] = ""


def expect_no_pictures(app: Any, config: Any) -> None:
    """`-D plot_gallery=0` leaves out pictures that pages show."""
    if str(config.plot_gallery) in ("0", "False"):
        config.suppress_warnings.append("image.not_readable")


def setup(app: Any) -> None:
    """Look at the settings, and at every page before it is written."""
    app.connect("config-inited", expect_no_pictures)
    app.connect("html-page-context", drop_edit_link)
