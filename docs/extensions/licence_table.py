"""Licences of installed requirements, from their metadata: the table that `docs/reference/licences.md` includes.

Start this file to print it.
"""

import re
import tomllib
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path

from argument_page import table
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
RUN = "run"  # the group of what jamlab itself requires
OF_RUN = "required by them"  # and of what that requires
CLASSIFIERS = {
    "Apache Software License": "Apache-2.0",
    "BSD License": "BSD",
    "GNU General Public License v2 (GPLv2)": "GPL-2.0-only",
    "GNU General Public License v2 or later (GPLv2+)": "GPL-2.0-or-later",
    "GNU General Public License v3 (GPLv3)": "GPL-3.0-only",
    "GNU General Public License v3 or later (GPLv3+)": "GPL-3.0-or-later",
    "GNU General Public License (GPL)": "GPL",
    "GNU Lesser General Public License v2 or later (LGPLv2+)": "LGPL-2.0-or-later",
    "GNU Lesser General Public License v3 or later (LGPLv3+)": "LGPL-3.0-or-later",
    "Historical Permission Notice and Disclaimer (HPND)": "HPND",
    "ISC License (ISCL)": "ISC",
    "MIT License": "MIT",
    "Mozilla Public License 2.0 (MPL 2.0)": "MPL-2.0",
    "Public Domain": "public domain",
    "Python Software Foundation License": "PSF-2.0",
}
SHORT = {"Apache 2.0": "Apache-2.0", "BSD 2-Clause License": "BSD-2-Clause", "BSD 3-Clause": "BSD-3-Clause"}


def requirements() -> dict[str, list[str]]:
    """Names of all direct requirements, each with its groups: `run` or extras."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    groups = {
        RUN: project["tool"]["dynamic-metadata"][0]["dependencies"],
        **project["project"]["optional-dependencies"],
    }
    found: dict[str, list[str]] = {}
    for group, lines in groups.items():
        for name in (canonicalize_name(Requirement(line).name) for line in lines):
            if name != "jamlab":
                found.setdefault(name, []).append(group)
    return found


def required_by(names: Iterable[str]) -> set[str]:
    """Names of the packages that installed ones require, and that are installed, without extras."""
    seen: set[str] = set()
    todo = list(names)
    while todo:
        name = todo.pop()
        for each in (Requirement(line) for line in _requires(name)):
            other = canonicalize_name(each.name)
            if other not in seen and _installed(other) and (each.marker is None or each.marker.evaluate({"extra": ""})):
                seen.add(other)
                todo.append(other)
    return seen


def licence(name: str) -> str | None:
    """The licence that the metadata of a package name, as SPDX where they say it; None if it is not installed."""
    if not _installed(name):
        return None
    known = metadata.metadata(name)
    if expression := known.get("License-Expression"):
        return str(expression)
    classifiers = [
        line.rpartition(" :: ")[2] for line in known.get_all("Classifier") or [] if line.startswith("License ::")
    ]
    named = [CLASSIFIERS.get(line, line) for line in classifiers if line != "OSI Approved"]
    if named:
        return " OR ".join(named)
    text = next(iter((known.get("License") or "").strip().splitlines()), "")
    first = re.split(r" License(?=$| )", text)[0] if text.startswith("BSD 3-Clause License") else text
    return SHORT.get(first, first) or "not named"


def rows() -> list[tuple[str, str, str]]:
    """Each installed requirement, its licence and what requires it, `run` first."""
    direct = requirements()
    more = required_by(name for name, groups in direct.items() if RUN in groups) - set(direct)
    everything = {**direct, **{name: [OF_RUN] for name in sorted(more)}}
    order = sorted(everything, key=lambda name: (RUN not in everything[name], OF_RUN not in everything[name], name))
    return [(name, known, ", ".join(everything[name])) for name in order if (known := licence(name))]


def licence_table() -> str:
    """The rows as a table of Markdown."""
    return table(("package", "licence", "required for"), rows())


def _requires(name: str) -> list[str]:
    return (metadata.requires(name) or []) if _installed(name) else []


def _installed(name: str) -> bool:
    try:
        metadata.version(name)
    except metadata.PackageNotFoundError:
        return False
    return True


if __name__ == "__main__":
    print(licence_table())
