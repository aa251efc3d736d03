"""Facts of the project for the pages, each from its one source: pyproject.toml, the tested versions, the gallery."""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parents[1]
PROJECT = tomllib.loads((DOCS.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
PURPOSES = {  # of every extra of pyproject.toml
    "images": "micrographs",
    "trajectories": "GSD files",
    "parquet": "tables as Parquet files",
    "dask": "campaigns through Dask",
    "studies": "`python -m studies`",
    "peers": "comparisons with other codes: `python -m studies compare`",
    "test": "tests",
    "docs": "these pages",
}
LISTED = 4  # requirements that the table of extras names


def substitutions() -> dict[str, str]:
    """What stands for `{{ name }}` on the pages."""
    from jamlab.engine.tested_versions import TESTED_LAMMPS, tested_pythons

    pythons = tested_pythons()
    return {
        "version": PROJECT["version"],
        "n_gallery": str(len(list((DOCS / "gallery_scripts").rglob("plot_*.py")))),
        "pythons": f"{pythons[0]} to {pythons[-1]}",
        "lammps": f"{TESTED_LAMMPS[0]} to {TESTED_LAMMPS[-1]}",
        "extras": extras_table(PROJECT["optional-dependencies"]),
    }


def extras_table(extras: Mapping[str, list[str]]) -> str:
    """Extras, the packages that each brings, and what they are for.

    Raises:
        ValueError: an extra without a purpose, or a purpose without an extra.
    """
    if odd := set(extras) ^ set(PURPOSES):
        raise ValueError(f"extras of pyproject.toml and PURPOSES of {__file__} differ: {', '.join(sorted(odd))}")
    rows = ["| `pip install` | brings | for |", "|---|---|---|"]
    for name, purpose in PURPOSES.items():
        packages = [_package(each) for each in extras[name]]
        brings = ", ".join(packages) if len(packages) <= LISTED else f"{len(packages)} packages"
        rows.append(f"| `'.[{name}]'` | {brings} | {purpose} |")
    return "\n".join(rows)


def _package(requirement: str) -> str:
    """Name of a package, or of the extras that an extra includes."""
    name = requirement.split(">")[0]
    return name.removeprefix("jamlab[").removesuffix("]").replace(",", ", ") if name.startswith("jamlab[") else name


def links(urls: Mapping[str, str]) -> dict[str, str]:
    """Links to the repository and its issues, as far as `[project.urls]` has them."""
    return {
        text: urls[key] for key, text in (("Repository", "Repository"), ("Issues", "Report an issue")) if key in urls
    }


def theme_options(urls: Mapping[str, str]) -> dict[str, Any]:
    """Settings of the theme: "edit this page" where there is a repository."""
    if "Repository" not in urls:
        return {}
    return {"source_repository": urls["Repository"], "source_branch": "main", "source_directory": "docs/"}
