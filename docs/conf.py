"""Sphinx settings. Build and check all of the documentation: `docs/check`, see CONTRIBUTING.md."""

import sys
import tomllib
from pathlib import Path

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS / "extensions"))

PROJECT = tomllib.loads((DOCS.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]

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
    "mathml_equations",
    "plain_docstrings",
    "reference_pages",
    "shown_output",
]
exclude_patterns = ["gallery_scripts", "examples", "gallery/**/*.ipynb", "gallery/**/*.py", "README.md"]
templates_path: list[str] = []
default_role = "py:obj"  # `names` in docstrings are links where they name something public
suppress_warnings = [
    "config.cache",  # functions in the settings of the gallery
    "ref.python",  # attributes of several results have one name, such as `storage`
]

myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
myst_url_schemes = {"http": None, "https": None, "mailto": None, "lammps": "https://docs.lammps.org/{{path}}.html"}

autodoc_typehints = "none"  # docstrings say types, shapes and units
autodoc_member_order = "bysource"
python_maximum_signature_line_length = 100
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
    "abort_on_example_error": True,
    "default_thumb_file": None,
    "reset_modules": ("matplotlib",),
}

html_theme = "furo"
html_title = f"jamlab {release}"
html_static_path = ["static"]
html_css_files = ["jamlab.css"]
html_show_sourcelink = False
html_copy_source = False
pygments_style = "friendly"
