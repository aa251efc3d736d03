"""The table of `docs/reference/licences.md`: licences of all requirements, from the metadata of installed packages.

    python docs/extensions/licence_table.py            # write it, in an environment with all extras
    python docs/extensions/licence_table.py --check    # say what differs, and fail

Rows of packages that are not installed stay as the page has them.
"""

import re
import sys
import tomllib
from collections.abc import Iterable, Iterator
from importlib import metadata
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "reference" / "licences.md"
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
    "ISC License (ISCL)": "ISC",
    "MIT License": "MIT",
    "Mozilla Public License 2.0 (MPL 2.0)": "MPL-2.0",
    "Public Domain": "public domain",
    "Python Software Foundation License": "PSF-2.0",
}
SHORT = {"Apache 2.0": "Apache-2.0", "BSD 2-Clause License": "BSD-2-Clause", "BSD 3-Clause": "BSD-3-Clause"}
ROW = re.compile(r"^\| (\S+) \| ([^|]+) \| ([^|]+) \|$", re.MULTILINE)
"""A requirement, its licence and the groups that require it."""


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
    """Each requirement, its licence and what requires it, `run` first."""
    direct = requirements()
    more = required_by(name for name, groups in direct.items() if RUN in groups) - set(direct)
    everything = {**direct, **{name: [OF_RUN] for name in sorted(more)}}
    before = {name: known for name, known, _ in ROW.findall(PAGE.read_text(encoding="utf-8"))} if PAGE.exists() else {}
    order = sorted(everything, key=lambda name: (RUN not in everything[name], OF_RUN not in everything[name], name))
    return [(name, licence(name) or before.get(name, "not installed"), ", ".join(everything[name])) for name in order]


def page() -> str:
    """The page with today's table below its text."""
    text = PAGE.read_text(encoding="utf-8")
    head, mark, _ = text.partition("| package | licence | required for |\n")
    return head + mark + "|---|---|---|\n" + "".join(f"| {' | '.join(row)} |\n" for row in rows())


def differences() -> Iterator[str]:
    """Rows of the page that the installed packages contradict, and packages without a row."""
    here = {name: (known, groups) for name, known, groups in ROW.findall(PAGE.read_text(encoding="utf-8"))}
    for name, known, groups in rows():
        if name not in here:
            yield f"{name} ({groups}) has no row: {known}"
        elif here[name] != (known, groups):
            yield f"{name}: {' | '.join(here[name])} stands there, {known} | {groups} is right"


def _requires(name: str) -> list[str]:
    return (metadata.requires(name) or []) if _installed(name) else []


def _installed(name: str) -> bool:
    try:
        metadata.version(name)
    except metadata.PackageNotFoundError:
        return False
    return True


if __name__ == "__main__":
    if "--check" in sys.argv[1:]:
        found = list(differences())
        print("\n".join(found) or f"{len(rows())} licences are as {PAGE.name} has them")
        sys.exit(bool(found))
    PAGE.write_text(page(), encoding="utf-8")
